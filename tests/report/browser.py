"""A real headless Chromium for the tests of the page, with the actions of a reader."""

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

selenium = pytest.importorskip("selenium", reason="the page is tested through selenium (PyPI)")

from selenium import webdriver  # noqa: E402
from selenium.common.exceptions import StaleElementReferenceException  # noqa: E402
from selenium.webdriver.chrome.service import Service  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402
from selenium.webdriver.remote.webelement import WebElement  # noqa: E402
from selenium.webdriver.support.ui import Select  # noqa: E402

__all__ = ["Browser", "Keys", "Select", "WebElement"]

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


class Browser:
    """Opens pages in a window of a given size."""

    def __init__(self, solid: bool = False) -> None:
        """``solid``: draw three dimensions by software, which makes flat pages slow."""
        program = next((found for name in BROWSERS if (found := shutil.which(name))), None)
        driver = shutil.which("chromedriver")
        if program is None or driver is None:
            pytest.skip("no Chromium with chromedriver (Debian: chromium, chromium-driver)")
        options = webdriver.ChromeOptions()
        options.binary_location = program
        software = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader") if solid else ()
        for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars", *software):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        options.unhandled_prompt_behavior = "ignore"  # a question stays until it is answered
        self.driver = webdriver.Chrome(options=options, service=Service(driver))
        # Without it a page loses its focus for a while after a dialog of the browser.
        self.driver.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})

    def open(
        self,
        page: Path | str,
        fragment: str = "",
        width: int = 1280,
        height: int = 800,
        scheme: str = "light",
    ) -> None:
        """The page of a file or an address, freshly loaded, under the conditions of a screen and
        its owner."""
        self.resize(width, height)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        self.leave()
        self.driver.get_log("browser")
        self.driver.get((page if isinstance(page, str) else page.as_uri()) + fragment)
        self.wait(lambda: self.all("header h1"))

    def resize(self, width: int, height: int) -> None:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def leave(self) -> None:
        """Show an empty page, so that nothing moves, sends requests or logs errors."""
        self.driver.get("about:blank")

    def errors(self) -> list[str]:
        """Return the errors of the console since the page was opened."""
        log = self.driver.get_log("browser")
        return [entry["message"] for entry in log if entry["level"] in ("SEVERE", "WARNING")]

    def run(self, script: str, *arguments: object) -> Any:
        return self.driver.execute_script(script, *arguments)

    def all(self, selector: str) -> list[WebElement]:
        return list(self.driver.find_elements(By.CSS_SELECTOR, selector))

    def one(self, selector: str) -> WebElement:
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def button(self, label: str) -> WebElement:
        return self.one(f'button[aria-label="{label}"]')

    def click(self, what: str) -> None:
        """Click a button by its label, or the first element of a selector; a page that redraws it
        meanwhile is asked again."""
        selector = what if what[0] in ".[" else f'button[aria-label="{what}"]'
        self.wait(lambda: self.one(selector).click() is None)

    def words(self, selector: str) -> str:
        """The text of the first element, empty if there is none."""
        script = "return document.querySelector(arguments[0])?.innerText ?? ''"
        return str(self.run(script, selector))

    def select(self, label: str, option: str) -> None:
        """Choose an option by its text; then keys are for the page again."""
        Select(self.one(f'[aria-label="{label}"]')).select_by_visible_text(option)
        self.run("document.activeElement.blur()")

    def go(self, tick: int, shown: int | None = None) -> None:
        """Follow the address of a tick."""
        self.run("location.hash = arguments[0]", f"#tick={tick}")
        self.wait(lambda: self.tick == (tick if shown is None else shown))

    def press(self, *keys: str) -> None:
        """Keys as a reader presses them, wherever the focus is."""
        actions = webdriver.ActionChains(self.driver)
        held = keys[:-1]
        for key in held:
            actions.key_down(key)
        actions.send_keys(keys[-1])
        for key in held:
            actions.key_up(key)
        actions.perform()

    def wait(
        self,
        condition: Callable[[], object],
        seconds: float = 300.0,
        lacks: str = "waited for something that did not happen",
    ) -> None:
        """Until the condition holds. Asking costs time of the processor, so the longer it takes,
        the longer are the pauses."""
        limit = time.monotonic() + seconds
        pause = 0.01

        def holds() -> object:
            try:
                return condition()
            except StaleElementReferenceException:  # the page redrew it during the query
                return False

        while not holds():
            assert time.monotonic() < limit, lacks
            time.sleep(pause)
            pause = min(1.3 * pause, 0.1)

    @property
    def tick(self) -> int:
        return int(self.one(".clock b").text)

    @property
    def seconds(self) -> float:
        return float(self.one(".clock .seconds").text.split()[0])

    def centre(self, robot: str) -> tuple[float, float]:
        """(column, row) where the robot is drawn, in regions; fractions on its way."""
        script = """
            const map = document.querySelector(".motion"), body = document.querySelector(
                `[data-robot="${arguments[0]}"] .body`).getBoundingClientRect();
            const box = map.getBoundingClientRect(), view = map.viewBox.baseVal;
            const scale = view.width / box.width;
            return [((body.left + body.width / 2 - box.left) * scale + view.x) / 40 - 0.5,
                    ((body.top + body.height / 2 - box.top) * scale + view.y) / 40 - 0.5];
        """
        col, row = self.run(script, robot)
        return col, row
