"""The 3D page: small, self-contained, and what a reader sees in a real browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from report.browser import Browser, Keys
from safenav.cli import group
from safenav.errors import UsageError
from safenav.motion.making import motion_of
from safenav.motion.source import read_source
from safenav.report.replay.reading import read_replay
from safenav.report.view3d.encode import RATE, encoded_motion
from safenav.report.view3d.html import page3d_of

SCENARIO = Path(__file__).parents[2] / "scenarios" / "case_study_1.yaml"

PICTURE = """
    const canvas = document.querySelector(".stage3d canvas");
    const copy = document.createElement("canvas");
    copy.width = 64; copy.height = 36;
    const brush = copy.getContext("2d");
    brush.drawImage(canvas, 0, 0, 64, 36);
    return [...brush.getImageData(0, 0, 64, 36).data].join(",");
"""


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("solid") / "door.jsonl"
    _safenav("run", str(SCENARIO), "--trace", str(path), "--no-map")
    return path


@pytest.fixture(scope="module")
def page(trace: Path) -> Path:
    path = trace.with_suffix(".html")
    source = read_source(trace)
    replay = read_replay(trace)
    motion = encoded_motion(motion_of(source.trace, source.digest), replay.last)
    path.write_text(page3d_of(replay, trace.name, motion), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    browser = Browser(solid=True)
    yield browser
    browser.driver.quit()


def test_a_case_study_fits_into_400_kilobytes_and_names_no_other_file(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) <= 400_000
    assert re.findall(r'(?:src|href)="([^"]*)"', text) == ["data:,"]
    assert "default-src 'none'" in text


def test_the_samples_are_where_the_robots_are(trace: Path) -> None:
    source = read_source(trace)
    replay = read_replay(trace)
    motion = motion_of(source.trace, source.digest)
    data = encoded_motion(motion, replay.last)
    assert len(data["clock"]) == replay.last + 1
    assert data["clock"] == sorted(data["clock"])
    assert data["samples"] == pytest.approx(motion.outcome.makespan * RATE, abs=2)
    assert all(begin < end for _, _, begin, end in data["reserved"])
    push = next(action for action in data["actions"] if action[2] == "push")
    assert push[1] == "door@47"
    resolved = next(event.tick for event in replay.events if event.kind.value == "resolved")
    assert data["clock"][resolved] >= push[4]


def test_the_page_opens_and_moves_without_a_complaint(page: Path, browser: Browser) -> None:
    browser.open(page, "#tick=5")
    browser.wait(lambda: browser.all(".stage3d canvas"))
    before = browser.run(PICTURE)
    assert len(set(before.split(","))) > 8, "the scene is blank"
    browser.press(Keys.END)
    browser.wait(lambda: browser.tick == 46)
    assert browser.run(PICTURE) != before
    browser.press("r")
    assert browser.run('return document.querySelector(".cameras select").value') == "0"
    browser.press("f")
    assert browser.run('return document.querySelector(".cameras select").value') == "orbit"
    assert browser.errors() == []


def test_it_plays_in_seconds(page: Path, browser: Browser) -> None:
    browser.open(page)
    browser.wait(lambda: browser.all(".stage3d canvas"))
    browser.press(" ")
    browser.wait(lambda: browser.tick >= 1, seconds=60)
    browser.press(" ")
    assert "s" in browser.one(".clock .seconds").text


def test_the_motion_of_another_trace_is_refused(trace: Path, tmp_path: Path) -> None:
    motion = tmp_path / "motion.jsonl"
    _safenav("motion", str(trace), "-o", str(motion))
    other = tmp_path / "other.jsonl"
    other.write_bytes(trace.read_bytes() + b"\n")
    page = tmp_path / "x.html"
    with pytest.raises(UsageError, match="the motion of another trace"):
        _safenav("replay", str(other), "--3d", "--motion", str(motion), "-o", str(page))
    assert not page.exists()


def test_a_motion_without_the_3d_page_is_a_wrong_usage(trace: Path) -> None:
    with pytest.raises(UsageError, match="--motion goes with --3d"):
        _safenav("replay", str(trace), "--motion", "x.jsonl")


def _safenav(*arguments: str) -> None:
    """A command of safenav in this process; what it refuses is raised."""
    group.main([*arguments], standalone_mode=False)
