"""The studio in a real browser, as its users see it: at the desk, with the keyboard alone, while a
run or a program of their own continues."""

import json
import os
import random
import time
import urllib.error
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from motion.runs import live_trace
from once import SCENARIOS, beside, trace_of_shipped
from report.browser import Browser, Keys
from runtime.worlds import Driven
from safenav import (
    LiveView,
    Mission,
    UsageError,
    load_scenario,
    load_scenario_text,
    read_run,
    read_trace,
)
from studio.board import Board
from studio.serving import MINUTES, Page, Served
from studio.test_editing import something

SHIPPED = load_scenario(SCENARIOS / "case_study_1.yaml")
DOOR = (SCENARIOS / "case_study_1.yaml").read_text()
HOUSE = beside(__file__, "scenarios/house.yaml")
DEN = 10


@pytest.mark.slow
def test_case_study_1_is_drawn_run_changed_and_undone(browser: Browser, tmp_path: Path) -> None:
    with Served("studio", tmp_path / "mine.yaml", "--no-browser") as served:
        board = Board(browser, served, SHIPPED.map.cols)
        blank = _draw_case_study_1(board)
        browser.press(Keys.CONTROL, "s")
        browser.wait(lambda: (tmp_path / "mine.yaml").exists())
        assert (tmp_path / "mine.yaml").read_text() == board.text
        browser.wait(lambda: "Saved: " in browser.words(".toast"))
        assert len(browser.all('[data-verdict="realizable"]')) == 2

        board.start()
        browser.wait(lambda: browser.all('button[aria-label="Run"]'))
        limit = time.monotonic() + MINUTES
        while _last_tick(board) < 5:
            assert time.monotonic() < limit
            browser.press(Keys.ARROW_RIGHT)
            time.sleep(0.1)
        board.close_with("door", 44)
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
            browser.click("Undo")
            board.changed(before)
        assert board.text == blank

        browser.driver.refresh()  # a reload in mid-run loses nothing
        board.choose("To the run")
        browser.wait(lambda: browser.tick >= 5)
        browser.driver.refresh()
        browser.wait(lambda: browser.all(".clock"), lacks="the run, which the page showed before")
        board.complete()
        lines = board.sound()
        assert b"</html>" in board.get("save/replay")
    (appeared,) = (line for line in lines if line["type"] == "appeared")
    assert (appeared["obstacle"], appeared["cause"]) == ("door@44", "user")
    resolved = {line["obstacle"]: line["robot"] for line in lines if line["type"] == "resolved"}
    assert resolved["door@47"] == "digit" and "door@44" in resolved
    assert browser.errors() == []


def _draw_case_study_1(board: Board) -> str:
    """Draw it with the mouse, and return the text of the blank map before."""
    browser = board.browser
    browser.click('[data-opens="New"]')
    board.choose("Blank map of that size")
    board.answer()
    board.until("    #############\n")
    blank = board.text
    browser.wait(lambda: browser.one("svg.floor .numbers"))
    board.rest()
    for tool, regions in {
        "Wall": (21, 34, 43, 60, 73),  # the inner walls of its map
        "quadcopter": (14,),
        "digit": (71,),
        "door": (47,),
    }.items():
        board.choose(tool)
        for region in regions:
            before = board.text
            board.click(region)
            board.changed(before)
    board.choose("Select")
    for start, targets in ((14, (54, 49)), (71, (58, 28))):
        board.click(start)
        browser.wait(lambda: browser.all(".chosen"))
        board.choose("Patrol")
        before = board.text
        board.click(targets[0])
        browser.wait(lambda: browser.all("text.order"))
        assert board.text == before, "half a patrol would be a mistake"
        board.click(targets[1])
        board.changed(before)
        browser.press(Keys.ESCAPE)
    drawn = load_scenario_text(board.text)
    assert drawn.map.walls == SHIPPED.map.walls
    assert [(r.name, r.model, r.start, r.objective) for r in drawn.robots] == [
        (r.name, r.model, r.start, r.objective) for r in SHIPPED.robots
    ]
    assert [(o.name, o.appears) for o in drawn.obstacles] == [("door@47", None)]
    browser.press(Keys.ESCAPE)
    browser.wait(lambda: len(browser.all('[data-verdict="realizable"]')) == 2)
    return blank


def _last_tick(board: Board) -> int:
    """The last tick of the run."""
    try:
        lines = board.get("save/trace").splitlines()
    except urllib.error.HTTPError:  # nothing has happened yet
        return -1
    return int(json.loads(lines[-1]).get("tick", 0))


@pytest.mark.slow
def test_a_studio_without_a_file_saves_opens_and_obeys_the_keyboard(
    browser: Browser, tmp_path: Path
) -> None:
    mine = tmp_path / "mine.yaml"
    (tmp_path / "wing").mkdir()
    (tmp_path / "wing" / "house.yaml").write_text(HOUSE)
    (tmp_path / "compose.yml").write_text("services: {}\n")
    with Served("studio", "--no-browser", cwd=tmp_path) as served:
        board = Board(browser, served, cols=9)
        browser.press(Keys.CONTROL, "s")
        assert board.answer("mine") == "File name"
        browser.wait(lambda: "mine.yaml" in browser.words("header"))
        blank = board.text
        assert mine.read_text() == blank

        def open_house() -> None:
            browser.click('[data-opens="Open"]')
            browser.wait(lambda: browser.all('[data-popup="Open"] button'))
            listed = [*filter(None, browser.words('[data-popup="Open"]').splitlines())]
            assert listed[-2:] == ["mine.yaml", "wing/house.yaml"]
            board.choose("wing/house.yaml")
            board.until("name: house")

        open_house()
        assert board.text == HOUSE
        for accept, content in ((False, blank), (True, HOUSE)):
            browser.click('[data-opens="Save"]')
            board.choose("Save as …")
            board.answer("mine")
            assert "already exists" in board.answer(accept=accept)
            browser.wait(lambda content=content: mine.read_text() == content)
        mine.write_text(f"{HOUSE}# somebody else wrote this\n")
        browser.press(Keys.CONTROL, "s")
        assert "has changed since it was opened" in board.answer(accept=False)
        assert mine.read_text() != HOUSE
        open_house()
        _draw_with_the_keyboard_alone(Board(browser, served, cols=9))
        assert browser.errors() == []


def _draw_with_the_keyboard_alone(board: Board) -> None:
    browser = board.browser

    def at(region: str) -> Callable[[], bool]:
        return lambda: f"region {region}" in browser.words(".readout")

    board.choose("humanoid")
    browser.run("document.querySelector('.map').focus({focusVisible: true})")
    browser.press(Keys.ARROW_RIGHT)
    browser.press(Keys.ARROW_RIGHT)
    browser.wait(at("12 [1, 3]"))
    browser.press(Keys.ENTER)
    board.until("humanoid: {model: humanoid, start: [1, 3], heading: east")
    browser.press("v")
    browser.press(Keys.SHIFT, Keys.ARROW_DOWN)
    board.until("humanoid: {model: humanoid, start: [2, 3], heading: east")
    browser.press("1")
    browser.press(Keys.ARROW_DOWN)
    browser.press(Keys.SHIFT, Keys.ARROW_LEFT)
    board.until("    #.###...#\n    #########\n  names")
    board.start()
    browser.select("Close a region with", "door")
    browser.run("document.querySelector('.map').focus({focusVisible: true})")
    for key in (*[Keys.ARROW_RIGHT] * 6, Keys.ARROW_DOWN, Keys.ARROW_DOWN):
        browser.press(key)
    browser.wait(at("34 "))
    tick = browser.tick  # from now on, ticks from before the pause may still be shown
    browser.press(Keys.ARROW_LEFT)
    browser.wait(at("33 "))  # no robot passes there
    assert browser.tick >= tick, "the arrows move the cursor"
    browser.press(Keys.ENTER)

    def stands() -> bool:
        """In the next tick; a click may first show the one during which the run was paused."""
        browser.click("Next tick")
        return bool(browser.all('[data-obstacle="door@33"]'))

    browser.wait(stands)


@pytest.mark.slow
def test_the_text_editor_shows_help_and_completions(browser: Browser, tmp_path: Path) -> None:
    """The keyboard passes through it. Errors stand at their position; a verdict has its reason."""
    (tmp_path / "house.yaml").write_text(HOUSE)
    with Served("studio", tmp_path / "house.yaml", "--no-browser") as served:
        house = Board(browser, served, cols=9)
        before = house.text
        place = browser.run("""
            const walk = document.createTreeWalker(document.querySelector(".cm-content"), 4);
            while (walk.nextNode()) if (walk.currentNode.data.includes("model")) break;
            const range = document.createRange();
            const at = walk.currentNode.data.indexOf("model");
            range.setStart(walk.currentNode, at + 1);
            range.setEnd(walk.currentNode, at + 3);
            const box = range.getBoundingClientRect();
            return {x: box.left + 2, y: box.top + 6};
        """)
        moved = {"type": "mouseMoved", **place}
        browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", moved)
        documented = "A robot model of the catalogue."
        browser.wait(lambda: browser.words(".cm-documentation") == documented)

        browser.run("document.querySelector('[aria-label=\"Whole map\"]').focus()")
        steps = []
        for key in (Keys.TAB, Keys.TAB):
            browser.press(key)
            steps.append(browser.run("return document.activeElement.matches('.cm-content')"))
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
            browser.wait(lambda offered=offered: browser.words(option) == offered)
            # Enter begins a new line until the option was shown for 75 ms.
            press = "new MouseEvent('mousedown', {bubbles: true})"
            browser.run(f"document.querySelector(arguments[0]).dispatchEvent({press})", option)
            house.until(chosen)

        line = next(i for i, told in enumerate(DOOR.splitlines(), 1) if "digit: {model" in told)
        house.write(DOOR.replace("model: digit", "modle: digit"))
        browser.wait(lambda: "modle" in browser.words(".problem"))
        assert browser.words(".problem .tick").strip() == str(line)
        browser.wait(lambda: "modle" in browser.words(".cm-lintRange-error"))
        assert browser.one("button.run").get_attribute("aria-disabled")
        house.write(DOOR)
        browser.wait(lambda: not browser.all(".problem"))

        house.write((SCENARIOS / "unrealizable" / "separate_rooms.yaml").read_text())
        unrealizable = '[data-verdict="unrealizable"]'
        browser.wait(lambda: "there is no path" in browser.words(unrealizable))

        house.write(HOUSE)
        house.rest()
        for held, to, words in (
            (DEN, 11, "start: [1, 2]"),
            (22, 24, "region: [2, 6]"),
            (34, 24, "start: [2, 6]"),
        ):
            house.click(held, to)
            house.until(words)
        browser.wait(lambda: browser.centre("eye") == pytest.approx((6, 2), abs=0.3))
        house.click(24)
        house.choose("Visit")
        house.click(28)
        house.click(33)
        house.until("visit: [[3, 1], [3, 6]]")
        browser.press(Keys.ESCAPE)
        browser.wait(lambda: len(browser.all("text.order")) == 2)
        house.click(28, 29)
        house.until("visit: [[3, 2], [3, 6]]")
        assert browser.errors() == []


def test_changes_by_a_user_take_effect_in_a_run(browser: Browser, tmp_path: Path) -> None:
    scenario = tmp_path / "yard.yaml"
    scenario.write_text(beside(__file__, "scenarios/yard.yaml"))
    with Served("run", scenario, "--live") as served:
        with served.opened() as page:
            page.say("restart")
            page.state(phase="paused")
        board = Board(browser, served, cols=8)
        browser.click('[role="switch"][aria-label="alarm"]')
        browser.click("Next tick")
        browser.wait(lambda: browser.all('[role="switch"][aria-checked="true"]'))
        orders = [b.text for b in browser.all("button") if b.text.startswith("Order: ")]
        assert orders == ["Order: parcel"]  # no robot can swap a flat battery
        board.choose("Order: parcel")
        board.click(10)
        board.choose("Out of service")
        board.close_with("door", 22)
        browser.click("Next tick")
        browser.wait(lambda: browser.all('[data-obstacle="door@22"]'))
        board.choose("Back in service")
        board.choose("Remove")
        board.click(22)
        board.choose("Assign")
        board.click(18)
        board.click(20)
        board.choose("Visit")
        browser.click('[role="switch"][aria-label="alarm"]')
        board.complete()
        lines = board.sound()
    assert [r["values"]["alarm"] for r in lines if r["type"] == "inputs"] == [1, 0]
    assert [r["obstacle"] for r in lines if r["type"] == "appeared"] == ["parcel@10", "door@22"]
    assert [r["obstacle"] for r in lines if r["type"] == "gone"] == ["door@22"]
    assert [r["active"] for r in lines if r["type"] == "service"] == [False, True]
    assert [r["robot"] for r in lines if r["type"] == "resolved"] == ["digit"]


def test_a_mission_in_the_users_own_world_is_shown_live(browser: Browser) -> None:
    fleet = Driven(SHIPPED)
    with LiveView(SHIPPED, browser=False) as view:
        mission = Mission(SHIPPED, world=fleet, listeners=[view])
        mission.start()
        browser.open(view.address)
        for _ in range(9):
            mission.step()
        browser.wait(lambda: browser.tick == 9)  # while the program does nothing
        assert fleet.count
        assert not browser.all('button[aria-label="Run"], button[aria-label="Pause the run"]')
        browser.press(" ")
        browser.wait(lambda: "the program with the mission controls it" in browser.words("body"))
        while mission.result is None:
            mission.step()
        assert mission.result.outcome == "completed"
        ticks = mission.result.ticks
        browser.wait(lambda: "completed" in browser.words("header") and browser.tick == ticks)
        saved = Page(view.address).get("save/trace").splitlines()
        ends = [json.loads(saved[at])["type"] for at in (0, -1)]
        assert ends == ["header", "outcome"]
        browser.leave()
        view.wait()


@pytest.mark.parametrize("name", ["case_study_3_beliefs", "live"])
def test_a_page_opened_late_shows_the_same_run(browser: Browser, name: str) -> None:
    """The news of all ticks add up to the whole run, which pages get when it ends."""
    file = live_trace("team_of_six") if name == "live" else trace_of_shipped(name)
    trace, run = read_trace(file), read_run(file)

    def shown() -> list[str]:
        """The page at the first events of the run, once it has all ticks."""
        end = "return Number(document.querySelector('.timeline input')?.max)"
        browser.wait(lambda: browser.run(end) == pytest.approx(run.time(run.last), abs=0.01))
        found: list[str] = browser.run("""
            const press = (key, shiftKey) => document.body.dispatchEvent(
                new KeyboardEvent("keydown", {key, shiftKey, bubbles: true}));
            const drawn = () => new Promise((done) => requestAnimationFrame(
                () => setTimeout(() => done(document.querySelector("main").innerHTML))));
            return (async () => {
                const found = [];
                press("Home", false);
                for (let event = 0; event < 20; event += 1) {
                    found.push(await drawn());
                    press("ArrowRight", true);
                }
                return found;
            })();
        """)
        return found

    with LiveView(trace.header.scenario, browser=False) as view:
        view(trace.header)
        browser.open(view.address)
        browser.wait(lambda: browser.all(".clock"))
        for record in trace.records[:-1]:
            view(record)
        first = shown()
        browser.open(view.address)
        assert len({*first}) > 5 and shown() == first


def test_a_port_in_use_is_refused() -> None:
    """Two studios that start at the same moment get different ports."""
    with LiveView(SHIPPED, browser=False) as first, LiveView(SHIPPED, browser=False) as second:
        port, other = (int(view.address.split(":")[2].split("/")[0]) for view in (first, second))
        assert port != other
        refused = pytest.raises(UsageError, match="cannot listen on port")
        with refused, LiveView(SHIPPED, port=port, browser=False):
            pass


SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 25 or 3
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
LENGTH = 25
ENDLESS = DOOR.split("expect:")[0]


@pytest.fixture(scope="module")
def changing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    file = tmp_path_factory.mktemp("random") / "mine.yaml"
    file.write_text(ENDLESS)
    with Served("studio", file, "--no-browser") as found:
        yield found


def request(drawing: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    """Draw a request that a page may send, sensible or not."""
    region, other = chance.randrange(-2, 100), chance.randrange(91)
    robot = chance.choice(("quad", "digit", "digit_2", "nobody", ""))
    obstacle = chance.choice(("door@47", f"door@{other}", "uncertainty@44", "x"))
    changes: list[dict[str, Any]] = [
        {"kind": "close", "type": "door", "region": region},
        {"kind": "close", "type": "uncertainty", "region": other, "truth": chance.random() < 0.5},
        {"kind": "open", "obstacle": obstacle},
        {"kind": "objective", "robot": robot, "objective": {"visit": [region, other]}},
        {"kind": "objective", "robot": robot, "objective": chance.choice(({}, [], {"hold": 17}))},
        {"kind": "service", "robot": robot, "active": chance.random() < 0.5},
        {"kind": ["strange"], "robot": {}},
    ]
    return chance.choice(
        [
            *({"does": "edit", **something(drawing, chance)} for _ in range(2)),
            {"does": "edit", "op": chance.choice((None, "paint")), "regions": "all", "wall": 3},
            *({"does": "change", **change} for change in chance.sample(changes, 4)),
            {"does": "step"},
            {"does": "step"},
            {"does": "play"},
            {"does": "pause"},
            {"does": "speed", "value": chance.choice((64, 8, 0, "x"))},
            {"does": "text", "text": chance.choice(("", "a: [", "safenav: 1", "- x"))},
            {"does": "text", "text": ENDLESS},
            {"does": "restart"},
        ]
    )


def test_random_sessions_raise_no_error_in_page_or_server(
    browser: Browser, changing: Served
) -> None:
    """One page in a browser looks on, another one says whatever comes."""
    browser.open(changing.address)
    for seed in range(FIRST, FIRST + SEQUENCES):
        print("sequence", seed, flush=True)
        with changing.opened() as page:
            _session(page, random.Random(seed))
    assert browser.errors() == []
    browser.driver.refresh()
    browser.wait(lambda: browser.all("header h1"))
    assert browser.errors() == []


def _session(page: Page, chance: random.Random) -> None:
    drawing = page.document("")["drawing"]
    for _ in range(LENGTH):
        page.say(**request(drawing, chance))
        if chance.random() < 0.3:
            time.sleep(0.05)
    page.say("end")
    marker = f"# {chance.random()}"
    page.say("text", text=marker)  # an answer to this is the last one
    assert page.document(marker)["problems"]
    states = [m["state"] for m in page.heard if m.get("state")]
    assert all(state["failure"] is None for state in states), states
    if _something_to_save(page.heard):
        page.sound()


def _something_to_save(heard: list[dict[str, Any]]) -> bool:
    """Whether the newest run came to its first line before it was ended."""
    found, phase = False, None
    for message in heard:
        before, phase = phase, (message.get("state") or {}).get("phase", phase)
        if message["is"] in ("run", "news"):
            found = message.get("run", message.get("news")) is not None
        elif phase == "starting" and before != "starting":  # another one begins
            found = False
    return found
