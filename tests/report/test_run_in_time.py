"""The page of a live run: it plays in seconds, and shows robots in transit."""

from pathlib import Path

import pytest

from motion.runs import live_trace
from report.browser import Browser
from safenav.report.page.html import page_of
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.trace.reading import read_bytes


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


def test_an_action_is_an_event_when_it_begins(browser: Browser, page: Path, replay: Run) -> None:
    """A page that follows a run learnt of it only from its end."""
    assert replay.seconds is not None
    begun = next(e for e in replay.events if e.kind.value == "act")
    done = next(e for e in replay.events if e.kind.value == "resolved")
    assert begun.text == "digit acts on door@47"
    assert replay.seconds[done.tick] - replay.seconds[begun.tick] > 2.0
    browser.open(page, f"#t={replay.seconds[begun.tick] + 0.1:.1f}")
    shown = [row.text for row in browser.all(".events [aria-current]")]
    assert any("digit acts on door@47" in text for text in shown)


def test_a_robot_is_between_two_regions_while_it_is_under_way(
    browser: Browser, page: Path, replay: Run
) -> None:
    step = replay.track("quad").steps[2]
    col, row = replay.map.position(replay.track("quad").regions[step.first])[::-1]
    to_col, to_row = replay.map.position(step.toward)[::-1]
    for part in (0.2, 0.8):
        browser.open(page, f"#t={step.begin + part * (step.end - step.begin):.1f}")
        where = browser.centre("quad")
        assert where == pytest.approx(
            (col + part * (to_col - col), row + part * (to_row - row)), abs=0.1
        )
    assert f"in transit to {replay.map.label(step.toward)}" in browser.one(".robots").text
