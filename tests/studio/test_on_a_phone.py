"""The studio in a real browser on a phone, and in a narrow window."""

import pytest

from report.browser import Keys
from studio.board import DEN, Board, rectangles, start

pytestmark = pytest.mark.slow


def test_two_fingers_zoom_the_map_while_walls_are_painted(house: Board) -> None:
    browser = house.browser
    browser.resize(380, 800)
    browser.press("1")
    text, (x, y) = house.text, house.at(20)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": px, "y": py, "id": k} for k, (px, py) in enumerate(places)]
        command = {"type": kind, "touchPoints": points}
        browser.driver.execute_cdp_cmd("Input.dispatchTouchEvent", command)

    browser.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    touch("touchStart", (x, y))
    touch("touchStart", (x, y), (x + 20, y))
    for step in range(1, 6):
        touch("touchMove", (x - 8 * step, y), (x + 20 + 8 * step, y))
    touch("touchEnd")
    browser.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
    browser.wait(lambda: browser.all(".map.near"))
    assert house.text == text, "nothing was painted"


def test_on_a_phone_the_map_comes_first_and_nothing_is_cut(house: Board) -> None:
    browser = house.browser
    browser.resize(380, 800)

    def width() -> int:
        return int(browser.run("return document.documentElement.scrollWidth"))

    def top(selector: str) -> float:
        script = "return document.querySelector(arguments[0]).getBoundingClientRect().top"
        return float(browser.run(script, selector))

    assert width() <= 380
    assert top(".map") < 160, "the header leaves room"
    assert top(".map") < top(".palette") < top(".writing")
    house.click(DEN)
    browser.wait(lambda: browser.all(".chosen .pens button"))
    for words, box in rectangles(browser, ".chosen .pens button").items():
        assert box[3] <= 800, words
        assert box[3] - box[1] >= 40, "a finger hits it"
    browser.run("document.querySelector('.text').scrollIntoView()")
    assert top(".map") >= 0, "the map stays in sight"
    browser.run("scrollTo(0, 0)")
    browser.press("1")
    _touch(house, 20, 21, 22)
    house.until("    #.###...#\n")
    browser.button("Undo").click()
    house.until("    #.......#\n")
    for menu in ("New", "Save"):
        browser.one(f'[data-menu="{menu}"] summary').click()
        (box,) = rectangles(browser, f'[data-menu="{menu}"] > div').values()
        assert box[0] >= 0 and box[2] <= 380
    browser.press(Keys.ESCAPE)
    start(house)
    assert width() <= 380
    assert top(".map") < top(".world") < top(".events")


def _touch(board: Board, *regions: int) -> None:
    """A finger from the first region to the last."""
    command = board.browser.driver.execute_cdp_cmd
    command("Emulation.setTouchEmulationEnabled", {"enabled": True})
    for index, region in enumerate(regions):
        x, y = board.at(region)
        kind = "touchMove" if index else "touchStart"
        command("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
    command("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    command("Emulation.setTouchEmulationEnabled", {"enabled": False})
