"""What people see of whole runs: the story on the terminal, the data of the page, the words of a
picture. ``make golden`` rewrites the files in ``transcripts/``: review the difference."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest

from report.runs import TOLD, run_of, text_of, trace_of
from runtime.played import loaded
from safenav import read_trace
from safenav.report.page.html import encoded
from safenav.report.picture.scene import svg_of
from safenav.report.terminal.story import Story
from safenav.run.run import Run
from safenav.run.values import StoryKind

TRANSCRIPTS = Path(__file__).with_name("transcripts")


def transcript(name: str) -> str:
    run = run_of(name)
    lines = [*_story(name), "", *_page(run), "", *_words(run)]
    plain = re.sub(r" in \d[\d.]* (ms|s)\b| in under 1 ms|, from the cache", "", "\n".join(lines))
    return re.sub(r"\(.*? summed\), .*? total", "(...)", plain) + "\n"


def _story(name: str) -> list[str]:
    said: list[str] = []
    tell = Story(loaded(text_of(name)), lambda line: said.append(click.unstyle(line)), maps=False)
    trace = read_trace(trace_of(name))
    for record in (trace.header, *trace.records):
        tell(record)
    return said


def _page(run: Run) -> Iterator[str]:
    """Yield the data that pages have of each thing, one on a line."""
    data = encoded(run, "x")
    quiet = {"robots", "obstacles", "events", "marks", "nose", "charger", "version", "grid", "name"}
    for key in sorted(data.keys() - quiet - {"ending"}):
        yield f"{key}: {json.dumps(data[key])}"
    for robot in data["robots"]:
        told = {k: v for k, v in robot.items() if k not in ("look", "shape", "can", "name")}
        yield from (f"{robot['name']} {key}: {json.dumps(told[key])}" for key in sorted(told))
    for obstacle in data["obstacles"]:
        told = {k: v for k, v in obstacle.items() if k not in ("shape", "opened", "name")}
        yield f"{obstacle['name']}: {json.dumps(told)}"
    yield from (json.dumps(event) for event in data["events"])


def _words(run: Run) -> Iterator[str]:
    texts = ElementTree.fromstring(_picture(run)).findall("{http://www.w3.org/2000/svg}text")
    yield from (element.text or "" for element in texts)


def _picture(run: Run) -> str:
    """Return a picture of the most eventful moment."""
    kinds = (StoryKind.REQUEST, StoryKind.VIOLATION, StoryKind.PLAN, StoryKind.GOAL)
    ranked = [event.tick for kind in kinds for event in run.told if event.kind is kind]
    return svg_of(run, ranked[0] if ranked else 0)


def _golden(found: str, name: str) -> None:
    file = TRANSCRIPTS / name
    if os.environ.get("SAFENAV_GOLDEN"):
        file.write_text(found, encoding="utf-8")
    assert found == file.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", TOLD)
def test_the_words_of_a_run_stay_the_same(name: str) -> None:
    _golden(transcript(name), f"{name}.txt")


@pytest.mark.parametrize("name", ["door", "zone", "loads", "slow"])
def test_the_picture_of_a_run_stays_the_same(name: str) -> None:
    """Open the file to review it: targets, intentions, names, loads, exclusions, steps, legend."""
    _golden(_picture(run_of(name)), f"{name}.svg")
