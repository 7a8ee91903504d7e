"""The drawing board as a user with mouse and keyboard sees it."""

import urllib.request
from contextlib import suppress

from selenium.common.exceptions import NoAlertPresentException
from selenium.webdriver.common.alert import Alert

from once import beside
from report.browser import Browser, Keys, Select, WebElement
from safenav.scenario.reading.loader import load_scenario
from studio.serving import MINUTES, SCENARIOS

SHIPPED = load_scenario(SCENARIOS / "case_study_1.yaml")


class Board:
    """The drawing board as a user with a mouse sees it."""

    def __init__(self, browser: Browser, address: str, cols: int = SHIPPED.map.cols) -> None:
        self.browser = browser
        self.cols = cols
        self.address = address
        browser.visit(address, width=1400, height=900)

    def at(self, region: int) -> tuple[int, int]:
        """The middle of a region, in pixels of the window."""
        x, y = self.browser.run(
            """
            const map = document.querySelector("svg.floor"), box = map.getBoundingClientRect();
            const view = map.viewBox.baseVal, scale = box.width / view.width;
            const [region, cols] = arguments;
            const [col, row] = [region % cols, Math.floor(region / cols)];
            return [box.left + ((col + 0.5) * 40 - view.x) * scale,
                    box.top + ((row + 0.5) * 40 - view.y) * scale];
            """,
            region,
            self.cols,
        )
        return int(x), int(y)

    def rest(self) -> None:
        """Wait until the map has found its place in the window."""
        self.browser.run("""
            const place = () => {
                const box = document.querySelector("svg.floor").getBoundingClientRect();
                return [box.left, box.top, box.width, box.height].join();
            };
            return new Promise((done) => {
                let before = "", still = 0;
                const look = () => {
                    still = place() === before ? still + 1 : 0;
                    before = place();
                    if (still === 20) done();
                    else requestAnimationFrame(look);
                };
                look();
            });
            """)

    def click(self, region: int) -> None:
        self.drag(region)

    def drag(self, *regions: int) -> None:
        """Press at the first region, release at the last."""
        for kind, region in (
            ("mousePressed", regions[0]),
            *(("mouseMoved", region) for region in regions[1:]),
            ("mouseReleased", regions[-1]),
        ):
            x, y = self.at(region)
            event = {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
            self.browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def choose(self, label: str) -> None:
        """Press a button with this text, as soon as the page shows it."""
        script = """
            return [...document.querySelectorAll("button")].find((button) =>
                button.getClientRects().length > 0 && button.innerText.trim() === arguments[0]);
        """
        found: list[WebElement | None] = []

        def shown() -> bool:
            found.append(self.browser.run(script, label))
            return found[-1] is not None

        self.browser.wait(shown, lacks=f"no button {label!r}")
        assert found[-1] is not None
        found[-1].click()

    def fast(self) -> None:
        """Let the run continue as fast as the page offers."""
        Select(self.browser.one("select[aria-label='Speed']")).select_by_value("64")

    @property
    def text(self) -> str:
        return self.saved("scenario").decode()

    def until(self, words: str) -> None:
        self.browser.wait(lambda: words in self.text)

    def saved(self, name: str) -> bytes:
        with urllib.request.urlopen(self.address + "save/" + name, timeout=MINUTES) as response:
            return bytes(response.read())

    def write(self, text: str) -> None:
        """Replace the text in the editor, as if it were pasted."""
        self.browser.one(".cm-content").click()
        self.browser.press(Keys.CONTROL, "a")
        self.browser.driver.execute_cdp_cmd("Input.insertText", {"text": text})


def close_with(browser: Browser, kind: str) -> None:
    """Choose the obstacle that the next click puts down."""
    Select(browser.one('[aria-label="Close a region with"]')).select_by_visible_text(kind)
    browser.run("document.activeElement.blur()")  # keys are for the page again


def answer(browser: Browser, typed: str | None = None, *, accept: bool = True) -> str:
    """Answer a question of the browser, and return its words."""
    found: list[Alert] = []

    def asked() -> bool:
        with suppress(NoAlertPresentException):
            found.append(browser.driver.switch_to.alert)
        return bool(found)

    browser.wait(asked, lacks="no question")
    said = str(found[0].text)
    if typed is not None:
        found[0].send_keys(typed)
    found[0].accept() if accept else found[0].dismiss()
    return said


HOUSE = beside(__file__, "scenarios/house.yaml")
WARD = "areas: {ward: {rows: 1-3, columns: 5-7}}\n"
DEN = 10


def words(browser: Browser, selector: str) -> str:
    """The text of an element, empty if there is none."""
    return str(
        browser.run("return document.querySelector(arguments[0])?.innerText ?? ''", selector)
    )


def toast(browser: Browser) -> str:
    browser.wait(lambda: browser.all(".toast"))
    return browser.one(".toast").text


def start(board: Board) -> None:
    """Run the scenario, and hold it immediately."""
    browser = board.browser
    board.choose("▶ Run")
    browser.wait(lambda: browser.all('button[aria-label="Pause the run"]'))
    browser.button("Pause the run").click()
    browser.wait(lambda: browser.one(".badge").text == "paused")


def readout(browser: Browser) -> str:
    return str(browser.run("return document.querySelector('.readout').textContent"))
