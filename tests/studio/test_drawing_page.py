"""In a real browser: draw case study 1 with mouse and keyboard, run it, close a door, undo."""

import json
import time
import urllib.error
from collections.abc import Iterator
from pathlib import Path

import pytest

from report.browser import Browser, Keys
from safenav.run.checked import check_trace
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.file import read_bytes
from safenav.trace.records import Appeared, Resolved
from safenav.trace.vocabulary import ChangeCause
from studio.board import SHIPPED, Board, answer, close_with, toast
from studio.serving import MINUTES, Served

pytestmark = pytest.mark.slow
BLANK_WALLS = [21, 34, 43, 60, 73]
"""What the map of case study 1 has beyond its border."""


@pytest.fixture
def board(browser: Browser, tmp_path: Path) -> Iterator[Board]:
    with Served("studio", tmp_path / "mine.yaml", "--no-browser") as served:
        yield Board(browser, served.address)


def test_case_study_1_is_drawn_run_changed_and_undone(board: Board, tmp_path: Path) -> None:
    browser = board.browser
    browser.one('[data-opens="New"]').click()
    board.choose("Blank map of that size")
    answer(browser)
    board.until("    #############\n")
    blank = board.text
    browser.wait(lambda: browser.one("svg.floor .numbers"))
    board.rest()
    board.choose("Wall")
    for region in BLANK_WALLS:
        before = board.text
        board.click(region)
        browser.wait(lambda before=before: board.text != before)
    board.choose("quadcopter")
    board.click(14)
    board.until("quad: {model: quadcopter")
    board.choose("digit")
    board.click(71)
    board.until("digit: {model: digit")
    board.choose("door")
    board.click(47)
    board.until("type: door")
    board.choose("Select")
    for robot, start, targets in (("quad", 14, (54, 49)), ("digit", 71, (58, 28))):
        board.click(start)
        browser.wait(lambda: browser.all(".chosen"))
        board.choose("Patrol")
        before = board.text
        board.click(targets[0])
        browser.wait(lambda: browser.all("text.order"))
        assert board.text == before, "half a patrol would be a mistake"
        board.click(targets[1])
        browser.wait(lambda before=before: board.text != before)
        board.until(robot)
        browser.press(Keys.ESCAPE)
    drawn = load_scenario_text(board.text)
    assert drawn.map.walls == SHIPPED.map.walls
    assert [(r.name, r.model, r.start, r.objective) for r in drawn.robots] == [
        (r.name, r.model, r.start, r.objective) for r in SHIPPED.robots
    ]
    assert [(o.name, o.appears) for o in drawn.obstacles] == [("door@47", None)]
    browser.press(Keys.ESCAPE)
    browser.wait(lambda: len(browser.all('[data-verdict="realizable"]')) == 2)
    browser.press(Keys.CONTROL, "s")
    browser.wait(lambda: (tmp_path / "mine.yaml").exists())
    assert (tmp_path / "mine.yaml").read_text() == board.text
    browser.wait(lambda: "Saved: " in toast(browser))
    assert len(browser.all('[data-verdict="realizable"]')) == 2

    board.choose("▶ Run")
    browser.wait(lambda: browser.all('button[aria-label="Pause the run"]'))
    browser.button("Pause the run").click()
    browser.wait(lambda: browser.all('button[aria-label="Run"]'))
    limit = time.monotonic() + MINUTES
    while json_tick(board) < 5:
        assert time.monotonic() < limit
        browser.press(Keys.ARROW_RIGHT)
        time.sleep(0.1)
    close_with(board.browser, "door")
    board.click(44)
    board.choose("Look")

    board.choose("✎ Draw")
    browser.wait(lambda: browser.all(".board"))
    board.choose("Select")
    board.click(14)
    browser.wait(lambda: browser.all(".chosen"))
    board.choose("Patrol")
    for target in (54, 49, 37):
        board.click(target)
    board.until("objective: {patrol: [[4, 2], [3, 10], [2, 11]]}")
    while not browser.button("Undo").get_attribute("aria-disabled"):
        before = board.text
        browser.button("Undo").click()
        browser.wait(lambda before=before: board.text != before)
    assert board.text == blank

    browser.driver.refresh()  # a reload in mid-run loses nothing
    board.choose("To the run")
    browser.wait(lambda: browser.tick >= 5)
    browser.driver.refresh()
    browser.wait(lambda: browser.all(".clock"), lacks="the run, which the page showed before")
    board.fast()
    browser.button("Run").click()
    browser.wait(lambda: browser.one(".badge").text == "completed")
    trace = read_bytes(board.saved("trace"))
    assert check_trace(trace).findings == ()
    (appeared,) = (record for record in trace.records if isinstance(record, Appeared))
    assert (appeared.obstacle, appeared.cause) == ("door@44", ChangeCause.USER)
    resolved = {r.obstacle: r.robot for r in trace.records if isinstance(r, Resolved)}
    assert resolved["door@47"] == "digit" and "door@44" in resolved
    assert b"</html>" in board.saved("replay")
    assert browser.errors() == []


def json_tick(board: Board) -> int:
    """The last tick of the run."""
    try:
        lines = board.saved("trace").splitlines()
    except urllib.error.HTTPError:  # nothing has happened yet
        return -1
    return int(json.loads(lines[-1]).get("tick", 0))
