"""Time on the page: the seconds of a live run, a run that ends within a tick."""

from __future__ import annotations

from pathlib import Path

import pytest

from motion.runs import live_trace
from once import beside
from report.browser import Browser
from safenav.cli.run import run as run_command
from safenav.report.page.html import page_of
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.trace.reading import Trace, read_bytes, read_trace


@pytest.fixture(scope="module")
def replay() -> Run:
    return run_of(read_bytes(live_trace("case_study_1")))


@pytest.fixture(scope="module")
def page(replay: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "door.html"
    path.write_text(page_of(replay, "door.jsonl"), encoding="utf-8")
    return path


def test_story_map_and_timeline_show_one_moment(browser: Browser, page: Path, replay: Run) -> None:
    assert replay.seconds is not None
    resolved = next(e for e in replay.events if e.kind.value == "resolved")
    at = replay.seconds[resolved.tick]
    for seconds, status in ((at - 0.3, "requested"), (at + 0.3, "resolved")):
        browser.open(page, f"#t={seconds:.1f}")
        assert browser.seconds == pytest.approx(seconds, abs=0.06)
        for place in (".knowledge", ".obstacles"):
            door = browser.one(f'{place} [data-obstacle="door@47"]')
            assert door.get_attribute("data-status") == status
        assert ("resolves" in browser.one(".story").text) == (status == "resolved")
        past = browser.all('.marks button.past[data-kind="resolved"]')
        assert len(past) == (status == "resolved")
    assert browser.errors() == []


SCENARIO = beside(__file__, "scenarios/failing.yaml")


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    folder = tmp_path_factory.mktemp("failed")
    (folder / "s.yaml").write_text(SCENARIO)
    file: Path = folder / "run.jsonl"
    arguments = [str(folder / "s.yaml"), "--trace", str(file), "--no-map"]
    assert run_command.main(arguments, standalone_mode=False) == 1
    return read_trace(file)


@pytest.fixture
def failed(trace: Trace) -> Run:
    return run_of(trace)


def test_the_last_tick_is_that_of_the_outcome(failed: Run) -> None:
    (violation,) = [event for event in failed.events if event.kind.value == "violation"]
    assert failed.events[-1].tick == failed.last == violation.tick
    assert failed.within, "the second robot had not taken its turn"
    assert f"tick {failed.last} of {failed.last}, ended within it: operator needed" == (
        failed.at(failed.last).moment
    )
