"""A run as pages see it: the same for all, changed and helped while it runs, whole when it ends."""

import io
import os
import signal
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from children import ran
from once import SCENARIOS
from report.browser import Browser
from runtime.test_operator import GATE
from studio.board import Board
from studio.serving import Page, Served

DOOR = SCENARIOS / "case_study_1.yaml"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with Served("run", DOOR, "--live") as found:
        yield found


@pytest.fixture
def page(served: Served) -> Iterator[Page]:
    """A page that shows a run, paused after its first tick."""
    with served.opened() as found:
        found.begin()
        yield found


def test_an_impossible_change_is_refused_with_the_reason(page: Page) -> None:
    page.say("change", kind="close", type="door", region=47)
    assert "door@47 already exists there" in page.refusal()
    page.say("change", kind="objective", robot="digit", objective={"hold": 5000})
    assert "outside the map" in page.refusal()


@pytest.mark.usefixtures("page")
def test_two_pages_agree_and_a_reload_in_mid_run_loses_nothing(served: Served) -> None:
    with served.opened() as one, served.opened() as other:
        first = one.hear(lambda m: m["is"] == "run")
        assert first == other.hear(lambda m: m["is"] == "run")
        one.say("step")
        at = first["run"]["last"] + 1
        one.tick(at)
        other.tick(at)
        news = [m["news"] for m in one.heard if m["is"] == "news"]
        assert news == [m["news"] for m in other.heard if m["is"] == "news"]
    with served.opened() as again:
        whole = again.hear(lambda m: m["is"] == "run")
    assert whole["run"]["last"] == at
    assert len(whole["run"]["robots"][0]["path"]) == at + 1


def test_an_ended_run_with_changes_is_saved_in_every_form_and_can_restart(
    page: Page, tmp_path: Path
) -> None:
    for tick, change in enumerate(
        (
            {"kind": "close", "type": "door", "region": 44},
            {"kind": "service", "robot": "digit", "active": False},
            {"kind": "objective", "robot": "digit", "objective": {"hold": 72}},
            {"kind": "service", "robot": "digit", "active": True},
        ),
        2,
    ):
        page.say("change", **change)
        page.say("step")
        page.tick(tick)
    page.say("end")
    assert page.state(phase="ended")["state"]["outcome"] == "interrupted"
    page.sound()
    shown = page.get("save/3d")
    assert b'id="motion"' in shown and b"</html>" in shown
    with zipfile.ZipFile(io.BytesIO(page.get("save/bundle"))) as files:
        files.extractall(tmp_path)
    (checker,) = tmp_path.rglob("check.py")
    done = ran([sys.executable, "-I", "-S", str(checker), str(checker.parent)])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "the world: 4" in done.stdout

    page.say("restart")
    page.state(phase="paused")
    page.tick(0)


def test_a_live_run_is_shown_in_seconds(tmp_path: Path) -> None:
    options = ("--live", "--clock", "live", "--trace", tmp_path / "run.jsonl")
    with Served("run", DOOR, *options) as served, served.opened() as page:
        page.say("speed", value=64)
        page.say("restart", play=True)
        page.hear(lambda m: m["is"] == "news" and m["news"]["times"][-1:] > [20.0])
        page.say("end")
        run = page.state(phase="ended")["run"]
        assert (tmp_path / "run.jsonl").read_bytes() == page.get("save/trace")
    assert run["times"][0] == 0 and run["times"] == sorted(set(run["times"]))
    assert any(robot["steps"] for robot in run["robots"])


@pytest.mark.slow
def test_an_operator_helps_a_waiting_run_from_the_page(browser: Browser, tmp_path: Path) -> None:
    scenario = tmp_path / "gate.yaml"
    scenario.write_text(GATE)
    with Served("run", scenario, "--live") as served, served.opened() as page:
        page.say("speed", value=64)
        page.say("play")
        page.state(phase="running")
        board = Board(browser, served, cols=11)
        browser.wait(lambda: browser.words(".badge") == "waits for an operator")
        begun = time.monotonic()
        for pause in (2, 0):
            page.heard.clear()
            page.say("change", kind="permanent", obstacle="gate@99")
            assert "known: gate@27" in page.refusal()
            time.sleep(pause)
        news = [m for m in page.heard if m["is"] == "news"]  # in the pause
        assert len(news) < 30 + 10 * (time.monotonic() - begun)
        board.choose("mark resolved")
        assert page.state(phase="ended")["state"]["outcome"] == "completed"
        lines = page.sound()
    assert [r["outcome"] for r in lines if r["type"] == "waiting"] == ["operator_needed"]
    assert [r["intervention"] for r in lines if r["type"] == "operator"] == ["resolved"]


def process_of(served: Served) -> int:
    """The process of the run, the only child of the server."""
    children = Path(f"/proc/{served.process}/task/{served.process}/children")
    if not children.exists():
        pytest.skip("asks Linux for the children of a process")
    return int(children.read_text())


def test_a_page_shows_that_a_long_tick_has_ended_and_can_end_the_run(
    page: Page, served: Served
) -> None:
    process = process_of(served)
    os.kill(process, signal.SIGSTOP)
    page.say("step")
    page.state(busy=True)
    os.kill(process, signal.SIGCONT)
    assert page.state(busy=False)["state"]["phase"] == "paused"
    os.kill(process, signal.SIGSTOP)
    page.say("end")
    assert page.state(phase="ended")["state"]["failure"] is None


def test_a_run_whose_process_is_killed_has_failed(page: Page, served: Served) -> None:
    """It does not look like one that a user has ended; the ticks before it are kept."""
    os.kill(process_of(served), signal.SIGKILL)
    ended = page.state(phase="ended")
    assert "ended (SIGKILL)" in ended["state"]["failure"]
    assert ended["run"]["last"] == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_ends_the_run_and_is_reported() -> None:
    with Served("run", DOOR, "--live", "--trace", "/dev/full") as served, served.opened() as page:
        for _ in range(2):  # another run ends the first one
            page.say("restart")
            page.state(phase="starting")
            failure = page.state(phase="ended")["state"]["failure"]
            assert failure == "cannot write the trace /dev/full: No space left on device"
