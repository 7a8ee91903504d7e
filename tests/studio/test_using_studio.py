"""In a real browser: what a new user tries first, at the desk, with the keyboard, on a phone."""

from __future__ import annotations

from pathlib import Path

import pytest

from report.browser import Browser, Keys
from studio.board import DEN, HOUSE, WARD, Board, answer, close_with, readout, start, words
from studio.serving import SCENARIOS, Served

pytestmark = pytest.mark.slow


def test_a_studio_without_a_file_saves_as_opens_and_is_used_by_keyboard(
    browser: Browser, tmp_path: Path
) -> None:
    (tmp_path / "wing").mkdir()
    (tmp_path / "wing" / "house.yaml").write_text(HOUSE)
    (tmp_path / "compose.yml").write_text("services: {}\n")
    with Served("studio", "--no-browser", cwd=tmp_path) as served:
        board = Board(browser, served.address)
        browser.press(Keys.CONTROL, "s")
        assert answer(browser, "mine") == "File name"
        browser.wait(lambda: (tmp_path / "mine.yaml").exists())
        browser.wait(lambda: "mine.yaml" in words(browser, "header"))
        mine = board.text
        assert (tmp_path / "mine.yaml").read_text() == mine

        open_file(board, "wing/house.yaml", ["mine.yaml", "wing/house.yaml"])
        board.until("name: house")
        assert board.text == HOUSE

        for accept, content in ((False, mine), (True, HOUSE)):
            browser.one('[data-opens="Save"]').click()
            board.choose("Save as …")
            answer(browser, "mine")
            assert "already exists" in answer(browser, accept=accept)
            browser.wait(lambda content=content: (tmp_path / "mine.yaml").read_text() == content)
        (tmp_path / "mine.yaml").write_text("somebody else wrote this\n")
        browser.press(Keys.CONTROL, "s")
        assert "has changed since it was opened" in answer(browser, accept=False)
        assert (tmp_path / "mine.yaml").read_text() == "somebody else wrote this\n"
        open_file(board, "wing/house.yaml")
        board.until("name: house")
        _draw_with_the_keyboard_alone(Board(browser, served.address, cols=9))
        assert browser.errors() == []


def open_file(board: Board, name: str, listed: list[str] | None = None) -> None:
    browser, menu = board.browser, '[data-popup="Open"]'
    browser.one('[data-opens="Open"]').click()
    browser.wait(lambda: browser.all(f"{menu} button"))
    names = [button.text for button in browser.all(f"{menu} button")]
    assert name in names and names == (listed or names)
    board.choose(name)


def _draw_with_the_keyboard_alone(board: Board) -> None:
    browser = board.browser
    board.choose("humanoid")
    browser.run("document.querySelector('.map').focus({focusVisible: true})")
    browser.press(Keys.ARROW_RIGHT)
    browser.press(Keys.ARROW_RIGHT)
    browser.wait(lambda: "region 12 [1, 3]" in readout(browser))
    browser.press(Keys.ENTER)
    board.until("humanoid: {model: humanoid, start: [1, 3], heading: east")
    browser.press("v")
    browser.press(Keys.SHIFT, Keys.ARROW_DOWN)
    board.until("humanoid: {model: humanoid, start: [2, 3], heading: east")
    browser.press("1")
    browser.press(Keys.ARROW_DOWN)
    browser.press(Keys.SHIFT, Keys.ARROW_LEFT)
    board.until("    #.###...#\n    #########\n  names")
    start(board)
    close_with(browser, "door")
    browser.run("document.querySelector('.map').focus({focusVisible: true})")
    tick = int(words(browser, ".clock").split()[-1])
    for key in (*[Keys.ARROW_RIGHT] * 5, Keys.ARROW_DOWN, Keys.ARROW_DOWN):
        browser.press(key)
    browser.wait(lambda: "region 33 " in readout(browser))  # where no robot comes by
    at_most = tick + 1  # the tick during which the run was paused
    assert browser.tick <= at_most, "the arrows move the cursor"
    browser.press(Keys.ENTER)

    def stands() -> bool:
        """In the next tick; a click may first show the one during which the run was paused."""
        browser.button("Next tick").click()
        return bool(browser.all('[data-obstacle="door@33"]'))

    browser.wait(stands)


def test_the_text_documents_completes_and_repairs(house: Board) -> None:
    """The keyboard passes through it. Errors stand at their position; a reason comes with a repair
    by a click. An area that it declares becomes a target."""
    browser, before = house.browser, house.text
    x, y = browser.run("""
        const walk = document.createTreeWalker(document.querySelector(".cm-content"), 4);
        while (walk.nextNode()) if (walk.currentNode.data.includes("model")) break;
        const range = document.createRange();
        const at = walk.currentNode.data.indexOf("model");
        range.setStart(walk.currentNode, at + 1);
        range.setEnd(walk.currentNode, at + 3);
        const box = range.getBoundingClientRect();
        return [box.left + 2, box.top + 6];
    """)
    event = {"type": "mouseMoved", "x": x, "y": y}
    browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)
    browser.wait(lambda: browser.all(".cm-documentation"))
    assert browser.one(".cm-documentation").text == "A robot model of the catalogue."

    inside = "return document.activeElement.matches('.cm-content')"
    browser.run("document.querySelector('[aria-label=\"Whole map\"]').focus()")
    steps = []
    for key in (Keys.TAB, Keys.TAB):
        browser.press(key)
        steps.append(browser.run(inside))
    assert steps == [True, False] and house.text == before

    option = ".cm-tooltip-autocomplete [aria-selected]"
    for begun, typed, offered, chosen in (
        ("limits: {", "tick", "ticks", "limits: {ticks: "),
        ("robots:\n  a:\n    ", "head", "heading", "    heading: "),
        ("robots: {a: {heading: ", "no", "north", "heading: north"),
        ("obstacles:\n  - type: door\n    trav", "e", "traversable", "    traversable: "),
        ("", "chargers", "chargers", "chargers: "),
    ):
        house.write(begun)
        for letter in typed:
            browser.press(letter)
        browser.wait(lambda offered=offered: words(browser, option) == offered)
        browser.one(option).click()  # Enter begins a new line until the option was shown for 75 ms
        browser.wait(lambda chosen=chosen: chosen in house.text)

    text = (SCENARIOS / "case_study_1.yaml").read_text()
    line = next(i for i, told in enumerate(text.splitlines(), 1) if "digit: {model" in told)
    house.write(text.replace("model: digit", "modle: digit"))
    browser.wait(lambda: "modle" in words(browser, ".problem"))
    assert words(browser, ".problem .tick").strip() == str(line)
    browser.wait(lambda: "modle" in words(browser, ".cm-lintRange-error"))
    assert browser.one("button.run").get_attribute("aria-disabled")
    house.write(text)
    browser.wait(lambda: not browser.all(".problem"))

    house.write((SCENARIOS / "unrealizable" / "separate_rooms.yaml").read_text())
    browser.wait(lambda: browser.all('[data-verdict="unrealizable"] .repair'))
    before = house.text
    browser.one(".repair").click()
    browser.wait(lambda: house.text != before)
    browser.wait(
        lambda: browser.all(".verdict") and not browser.all('[data-verdict="unrealizable"]')
    )

    house.write(HOUSE.replace("robots:\n  hugo", WARD + "robots:\n  hugo"))
    house.until(WARD)
    house.rest()
    house.click(DEN)
    browser.wait(lambda: browser.all(".chosen .pens button"))
    house.choose("Hold")
    house.choose("ward")
    house.until("objective: {hold: ward}")
    assert browser.errors() == []
