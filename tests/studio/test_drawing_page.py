"""In a real browser: draw case study 1 with mouse and keyboard, run it, close a door, undo."""

from __future__ import annotations

import json
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from report.browser import Browser, Keys, Select
from safenav.audit.check import audit
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.trace.reading import read_bytes
from safenav.trace.records import Appeared, Move, Resolved
from studio.serving import MINUTES, SCENARIOS, Served

SHIPPED = load_scenario(SCENARIOS / "case_study_1.yaml")
pytestmark = pytest.mark.slow
BLANK_WALLS = [21, 34, 43, 60, 73]
"""What the map of case study 1 has beyond its border."""


class Board:
    """The drawing board as somebody with a mouse sees it."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.browser = browser
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
            SHIPPED.map.cols,
        )
        return int(x), int(y)

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
        """Press a button with this text."""
        found = [b for b in self.browser.all("button") if b.text.strip() == label]
        assert found, f"no button {label!r}"
        found[0].click()

    def fast(self) -> None:
        """Let the run go on as fast as the page offers."""
        Select(self.browser.one(".speed select")).select_by_value("64")

    @property
    def text(self) -> str:
        return str(self.browser.run("return document.querySelector('.text textarea')?.value"))

    def until(self, words: str) -> None:
        self.browser.wait(lambda: words in self.text, MINUTES)

    def saved(self, name: str) -> bytes:
        with urllib.request.urlopen(self.address + "save/" + name, timeout=MINUTES) as response:
            return bytes(response.read())


@pytest.fixture
def board(browser: Browser, tmp_path: Path) -> Iterator[Board]:
    with Served("studio", tmp_path / "mine.yaml", "--no-browser") as served:
        yield Board(browser, served.address)


def test_case_study_1_is_drawn_run_and_undone(board: Board, tmp_path: Path) -> None:
    browser = board.browser
    blank = board.text
    browser.one(".menu.left summary").click()
    board.choose("Blank map of that size")
    board.until("    #############\n")
    browser.wait(lambda: browser.one("svg.floor .numbers"), MINUTES)
    time.sleep(0.3)  # the new map finds its place in the window
    board.choose("Wall")
    for region in BLANK_WALLS:
        before = board.text
        board.click(region)
        browser.wait(lambda before=before: board.text != before, MINUTES)  # type: ignore[misc]
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
        browser.wait(lambda: browser.all(".chosen"), MINUTES)
        board.choose("Patrol: to and fro")
        before = board.text
        board.click(targets[0])
        browser.wait(lambda: browser.all("text.order"), MINUTES)
        assert board.text == before, "half a patrol would be a mistake"
        board.click(targets[1])
        browser.wait(lambda before=before: board.text != before, MINUTES)  # type: ignore[misc]
        board.until(robot)
        browser.press(Keys.ESCAPE)
    drawn = load_scenario_text(board.text)
    assert drawn.map.walls == SHIPPED.map.walls
    assert [(r.name, r.model, r.start, r.objective) for r in drawn.robots] == [
        (r.name, r.model, r.start, r.objective) for r in SHIPPED.robots
    ]
    assert [(o.name, o.appears) for o in drawn.obstacles] == [("door@47", None)]
    browser.wait(lambda: len(browser.all('[data-verdict="realizable"]')) == 2, MINUTES)
    browser.press(Keys.CONTROL, "s")
    browser.wait(lambda: (tmp_path / "mine.yaml").exists(), MINUTES)
    assert (tmp_path / "mine.yaml").read_text() == board.text

    board.choose("▶ Run")
    browser.wait(lambda: browser.all(".speed select"), MINUTES)
    board.fast()
    browser.wait(lambda: browser.all(".badge.good"), MINUTES)
    trace = read_bytes(board.saved("trace"))
    assert audit(trace).findings == ()
    resolved = [(r.obstacle, r.robot) for r in trace.records if isinstance(r, Resolved)]
    assert resolved == [("door@47", "digit")]

    board.choose("✎ Draw")
    browser.wait(lambda: browser.all(".board"), MINUTES)
    while browser.button("Undo").is_enabled():
        before = board.text
        browser.button("Undo").click()
        browser.wait(lambda before=before: board.text != before, MINUTES)  # type: ignore[misc]
    assert board.text == blank
    assert browser.errors() == []


def test_a_broken_scenario_shows_its_mistakes_at_their_place(board: Board) -> None:
    browser = board.browser
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    line = next(i for i, told in enumerate(text.splitlines(), 1) if "digit: {model" in told)
    _type(browser, text.replace("model: digit", "modle: digit"))
    browser.wait(lambda: any("modle" in p.text for p in browser.all(".problem")), MINUTES)
    assert browser.one(".gutter .wrong").text.strip() == str(line)
    assert not browser.one("button.run").is_enabled()
    _type(browser, text)
    browser.wait(lambda: not browser.all(".problem"), MINUTES)
    _type(browser, text.replace("start: 71", "start: 0"))
    browser.wait(lambda: browser.all("g.wrong"), MINUTES)


def test_a_robot_that_cannot_gets_the_reason_and_a_repair_at_a_click(board: Board) -> None:
    browser = board.browser
    _type(browser, (SCENARIOS / "unrealizable" / "separate_rooms.yaml").read_text())
    browser.wait(lambda: browser.all('[data-verdict="unrealizable"] .repair'), MINUTES)
    before = board.text
    browser.one(".repair").click()
    browser.wait(lambda: board.text != before, MINUTES)
    browser.wait(
        lambda: browser.all(".verdict") and not browser.all('[data-verdict="unrealizable"]'),
        MINUTES,
    )


def test_a_door_is_closed_by_a_click_and_the_saved_scenario_plays_the_same(board: Board) -> None:
    from safenav.runtime.mission import Mission

    browser = board.browser
    _type(browser, (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0])
    board.until("door")
    browser.wait(lambda: browser.one("button.run").is_enabled(), MINUTES)
    board.choose("▶ Run")
    browser.wait(lambda: browser.all('button[aria-label="Pause the run"]'), MINUTES)
    browser.button("Pause the run").click()
    browser.wait(lambda: browser.all('button[aria-label="Run"]'), MINUTES)
    limit = time.monotonic() + MINUTES
    while json_tick(board) < 5:
        assert time.monotonic() < limit
        browser.button("One tick on").click()
        time.sleep(0.1)
    board.choose("Close: door")
    board.click(44)
    board.choose("Look")
    browser.driver.refresh()  # a reload in mid-run loses nothing
    browser.wait(lambda: browser.all("header h1"), MINUTES)
    board.choose("To the run")
    browser.wait(lambda: browser.tick >= 5, MINUTES)
    board.fast()
    browser.button("Run").click()
    browser.wait(lambda: browser.all(".badge.good"), MINUTES)
    trace = read_bytes(board.saved("trace"))
    assert audit(trace).findings == ()
    (appeared,) = (record for record in trace.records if isinstance(record, Appeared))
    assert appeared.obstacle == "door@44"
    assert "door@44" in {r.obstacle for r in trace.records if isinstance(r, Resolved)}
    again: list[Any] = []
    mission = Mission(load_scenario_text(board.saved("played").decode()), listeners=[again.append])
    mission.run()

    def moves(records: Any) -> list[Any]:
        return [(m.tick, m.robot, m.to) for m in records if isinstance(m, Move)]

    assert moves(again) == moves(trace.records)
    assert browser.errors() == []


def test_a_link_carries_the_scenario(board: Board) -> None:
    browser = board.browser
    board.choose("Floor")
    link = browser.run(
        """
        const stream = new Blob([arguments[0]]).stream()
            .pipeThrough(new CompressionStream("deflate-raw"));
        return new Response(stream).arrayBuffer().then((buffer) =>
            btoa(String.fromCharCode(...new Uint8Array(buffer)))
                .replace(/\\+/g, "-").replace(/\\//g, "_").replace(/=+$/, ""));
        """,
        (SCENARIOS / "hello.yaml").read_text(),
    )
    browser.driver.get("about:blank")
    browser.driver.get(f"{board.address}#scenario={link}")
    board.until("hello")
    assert board.text == (SCENARIOS / "hello.yaml").read_text()
    assert link not in browser.driver.current_url


def test_maps_are_sent_through_the_page(board: Board, tmp_path: Path) -> None:
    """An image and a ROS map, divided as the page says, and a MovingAI map."""
    browser = board.browser
    walls = np.full((24, 36), 255, dtype=np.uint8)
    walls[:4], walls[-4:], walls[:, :4], walls[:, -4:] = 0, 0, 0, 0
    walls[12:16, 16:20] = 0
    Image.fromarray(walls).save(tmp_path / "floor.png")
    Image.fromarray(walls).save(tmp_path / "lab.pgm")
    (tmp_path / "lab.yaml").write_text(
        "image: lab.pgm\nresolution: 0.25\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "arena.map").write_text(
        "type octile\nheight 4\nwidth 5\nmap\n@@@@@\n@...@\n@.@.@\n@@@@@\n"
    )

    def send(*names: str) -> None:
        files = "\n".join(str(tmp_path / name) for name in names)
        browser.one('.menu.left input[type="file"][multiple]').send_keys(files)

    def divide(rows: str, cols: str) -> None:
        browser.one(".menu.left summary").click()
        for label, number in (("Rows", rows), ("Columns", cols)):
            field = browser.one(f'input[aria-label="{label}"]')
            field.send_keys(Keys.CONTROL, "a")
            field.send_keys(Keys.NULL, Keys.BACKSPACE, number)
        browser.one(".menu.left summary").click()

    grid = "    #########\n    #.......#\n    #.......#\n    #...#...#\n"
    divide("", "")
    send("lab.yaml", "lab.pgm")
    browser.wait(lambda: browser.all(".toast"), MINUTES)
    assert "Rows x Columns" in browser.one(".toast").text
    assert "--" not in browser.one(".toast").text
    assert str(tempfile.gettempdir()) not in browser.one(".toast").text
    divide("6", "9")
    for name, files in (("lab", ("lab.yaml", "lab.pgm")), ("floor", ("floor.png",))):
        send(*files)
        board.until(f"name: {name}\n")
        assert grid in board.text
    send("arena.map")
    board.until("name: arena\n")
    assert "    #...#\n    #.#.#\n" in board.text
    refused = [told for told in browser.errors() if "400" not in told]
    assert refused == []


def json_tick(board: Board) -> int:
    """The last tick of the run."""
    try:
        lines = board.saved("trace").splitlines()
    except urllib.error.HTTPError:  # nothing has happened yet
        return -1
    return int(json.loads(lines[-1]).get("tick", 0))


def _type(browser: Browser, text: str) -> None:
    """Put a text into the editor as if it were pasted."""
    browser.run(
        """
        const area = document.querySelector(".text textarea");
        area.value = arguments[0];
        area.dispatchEvent(new Event("input", {bubbles: true}));
        """,
        text,
    )
