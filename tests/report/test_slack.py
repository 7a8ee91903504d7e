"""Deadlines under the timeline: the duration of each, and its remaining time."""

import json
import re
from pathlib import Path

import pytest

from report.browser import Browser
from runtime.played import play
from safenav.motion.making import motion_of
from safenav.report.page.encode import encoded
from safenav.report.page.html import page_of
from safenav.report.view3d.html import page3d_of
from safenav.run.reading import read_run, run_of
from safenav.run.run import Run
from safenav.trace.reading import read_trace

TIMED = """
map:
  grid: ["#######", "#.....#", "#.....#", "#######"]
robots:
  r: {model: digit, start: [1, 1], heading: east, objective: OBJECTIVE}
until: {rounds: 2, by: 60}
late: go_on
""".replace("OBJECTIVE", "{visit: [[1, 5], [1, 1]], within: 14}")


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return read_run(_trace(tmp_path_factory.mktemp("slack")))


def _trace(folder: Path) -> Path:
    path = folder / "timed.jsonl"
    path.write_text(play(TIMED).text)
    return path


def test_in_3d_deadlines_are_at_the_instants_of_their_ticks(tmp_path: Path) -> None:
    """Their slack was that between the number of an instant and a tick."""
    trace = read_trace(_trace(tmp_path))
    (data,) = re.findall(r'id="run">(.*?)</script>', page3d_of(trace, "t", motion_of(trace)))
    run = json.loads(data)
    flat = encoded(run_of(trace), "t")["deadlines"]
    for (instant, of, begin, due, *told), tick in zip(run["deadlines"], flat, strict=True):
        assert [of, *told] == [tick[1], *tick[4:]]
        assert begin <= instant <= due <= run["last"], of


def test_the_page_shows_the_slack(browser: Browser, replay: Run, tmp_path: Path) -> None:
    page = tmp_path / "timed.html"
    page.write_text(page_of(replay, "timed.jsonl"))
    browser.open(page)
    assert browser.errors() == []
    told = {one.get_attribute("data-of"): one.text for one in browser.all(".deadlines li")}
    least = min(left for _, of, *_, left in encoded(replay, "t")["deadlines"] if of == "r")
    assert told["r"] == f"r: met, {least} ticks of slack"
    assert told["mission"] == f"mission: met, {60 - replay.last} ticks of slack"
    bars = browser.all('.deadlines li[data-of="r"] .used')
    assert len(bars) == 2
