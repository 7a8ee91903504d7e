"""Kinds of motion that a package adds, as docs/motion.md shows it."""

import importlib.metadata
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from motion.runs import played
from safenav.motion.check.verdict import check_motion
from safenav.motion.file.records import Flight
from safenav.motion.making import motion_of
from safenav.trace.reading import read_bytes

DOCUMENT = Path(__file__).parents[2] / "docs" / "motion.md"

SCENARIO = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#######"]}
catalogue: {robots: {snail: {mobility: free, layer: ground, motion: crawler, speed: 0.2}}}
robots: {gary: {model: snail, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}}
until: {rounds: 1}
"""


class Entry:
    """Stands for the entry point of an installed package."""

    name = "crawler"

    def load(self) -> type:
        (code,) = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
        names: dict[str, object] = {}
        exec(compile(code, "crawling.py", "exec", dont_inherit=True), names)
        found = names["Crawler"]
        assert isinstance(found, type)
        return found


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    usual: Callable[..., object] = importlib.metadata.entry_points

    def entry_points(**wanted: str) -> object:
        if wanted.get("group") != "safenav.motion":
            return usual(**wanted)
        return [Entry()] if wanted.get("name", "crawler") == "crawler" else []

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)


@pytest.mark.usefixtures("installed")
def test_kind_of_the_documentation_moves_and_is_accepted() -> None:
    content = played(SCENARIO)
    trace = read_bytes(content, "crawled")
    motion = motion_of(trace)
    assert {line.primitive for line in motion.lines if isinstance(line, Flight)} == {"crawl"}
    assert motion.header.robots["gary"]["speed"] == 0.2
    assert check_motion(motion, trace) == []
