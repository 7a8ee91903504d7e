"""The drawing board as a user with mouse and keyboard sees it."""

from contextlib import suppress

from selenium.common.exceptions import NoAlertPresentException, UnexpectedAlertPresentException
from selenium.webdriver import ActionChains
from selenium.webdriver.common.alert import Alert

from report.browser import Browser, Keys, WebElement
from studio.serving import Page, Served


class Board(Page):
    """The page of a studio in a browser. ``cols``: those of the map that is drawn."""

    def __init__(self, browser: Browser, served: Served, cols: int) -> None:
        super().__init__(served.address)
        self.browser = browser
        self.cols = cols
        browser.open(served.address, width=1400, height=900)

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

    def click(self, region: float, to: int | None = None) -> None:
        """Press the mouse in the centre of a region, or a fraction east of it; drag to another."""
        places = self.browser.run(
            """
            const map = document.querySelector("svg.floor"), box = map.getBoundingClientRect();
            const view = map.viewBox.baseVal, scale = box.width / view.width;
            const [regions, cols] = arguments;
            return regions.map((region) => {
                const [col, row] = [region % cols, Math.floor(region / cols)];
                return {x: Math.floor(box.left + ((col + 0.5) * 40 - view.x) * scale),
                        y: Math.floor(box.top + ((row + 0.5) * 40 - view.y) * scale)};
            });
            """,
            [region, region if to is None else to],
            self.cols,
        )
        kinds = ("mousePressed", "mouseMoved", "mouseReleased")
        for kind, place in zip(kinds, (places[0], places[1], places[1]), strict=True):
            event = {"type": kind, **place, "button": "left", "buttons": 1, "clickCount": 1}
            self.browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def choose(self, label: str) -> None:
        """Press a button with this text, as soon as the page shows it."""
        script = """
            return [...document.querySelectorAll("button")].find((button) =>
                button.getClientRects().length > 0 && button.innerText.trim() === arguments[0]);
        """

        def pressed() -> bool:
            found: WebElement | None = self.browser.run(script, label)
            return found is not None and found.click() is None

        self.browser.wait(pressed, lacks=f"no button {label!r}")

    def close_with(self, kind: str, region: int) -> None:
        """Put an obstacle into a region of the run."""
        self.browser.select("Close a region with", kind)
        self.click(region)

    def start(self) -> None:
        """Run the scenario, and hold it immediately."""
        self.choose("▶ Run")
        self.browser.wait(lambda: self.browser.all('button[aria-label="Pause the run"]'))
        self.browser.click("Pause the run")
        self.browser.wait(lambda: self.browser.words(".badge") == "paused")

    def complete(self) -> None:
        """Let the run continue to its end, as fast as the page offers."""
        self.browser.select("Speed", "64 ticks/s")
        self.browser.click("Run")
        self.browser.wait(lambda: self.browser.words(".badge") == "completed")

    @property
    def text(self) -> str:
        return self.get("save/scenario").decode()

    def until(self, words: str) -> None:
        self.browser.wait(lambda: words in self.text, lacks=f"no {words!r} in the text")

    def changed(self, before: str) -> None:
        self.browser.wait(lambda: self.text != before, lacks="the text stays the same")

    def write(self, text: str) -> None:
        """Replace the text in the editor, as if it were pasted."""
        self.browser.click(".cm-content")
        self.browser.press(Keys.CONTROL, "a")
        self.browser.driver.execute_cdp_cmd("Input.insertText", {"text": text})

    def answer(self, typed: str | None = None, *, accept: bool = True) -> str:
        """Answer a question of the browser, and return its words."""
        found: list[Alert] = []

        def asked() -> bool:
            with suppress(NoAlertPresentException):
                found.append(self.browser.driver.switch_to.alert)
            return bool(found)

        self.browser.wait(asked, lacks="no question")
        said = str(found[0].text)
        if typed is not None:
            found[0].send_keys(typed)
        found[0].accept() if accept else found[0].dismiss()
        # The question may have come before the keys were released that led to it. If the next one
        # is already there, they are released after that.
        with suppress(UnexpectedAlertPresentException):
            ActionChains(self.browser.driver).reset_actions()
        return said
