"""What people see of whole runs: the story on the terminal, the data of the page, the words of a
picture. ``make golden`` rewrites the files in ``transcripts/``: review the difference."""

import json
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest

from once import SCENARIOS, beside
from report import made_traces
from runtime.played import loaded, play
from safenav.report.page.html import encoded
from safenav.report.picture.scene import svg_of
from safenav.report.terminal.story import Story
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.run.values import StoryKind
from safenav.trace.file import Trace, read_bytes

TRANSCRIPTS = Path(__file__).with_name("transcripts")


def own(name: str) -> str:
    return beside(__file__, f"scenarios/{name}.yaml")


def shipped(name: str) -> str:
    return (SCENARIOS / f"{name}.yaml").read_text(encoding="utf-8")


LONELY = """\
safenav: 1
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots: {quad: {model: quadcopter, start: 10, objective: OBJECTIVE}}
MORE
"""


def lonely(objective: str, more: str = "until: {rounds: 2}") -> str:
    return LONELY.replace("OBJECTIVE", objective).replace("MORE", more)


TWICE = "obstacles: [{type: door, region: 22, %s until: 5}, {type: door, region: 22, from: 8, \
until: 10}]\nuntil: {rounds: 4}"
ALARM = "inputs: {alarm: {at: [3-8]}}\nuntil: {rounds: 3}"
TIMED = "until: {rounds: 2, by: 60}\nlate: go_on"

CASES: dict[str, Callable[[], str]] = {
    "door": lambda: shipped("case_study_1"),
    "chain": lambda: shipped("case_study_3"),
    "beliefs": lambda: shipped("case_study_1_beliefs"),
    "joint_plan": lambda: shipped("corridor_swap"),
    "loads": lambda: shipped("warehouse_orders"),
    "detour": lambda: made_traces.DETOUR,
    "meeting": lambda: made_traces.MEETING,
    "slow": lambda: made_traces.SLOW,
    "charges": lambda: own("cart"),
    "two_needs": lambda: own("two_needs"),
    "pushed": lambda: own("pushed"),
    "zone": lambda: own("zone"),
    "operator": lambda: own("failing"),
    "once": lambda: lonely("{once: [12, 11]}", "until: {rounds: 1}"),
    "hold": lambda: lonely("{hold: 12}", "until: {rounds: 3}"),
    "formulas": lambda: lonely("{ltl: {liveness: [region = 10, region = 12]}}"),
    "twice": lambda: lonely("{patrol: [10, 12]}", TWICE % ""),
    "twice_later": lambda: lonely("{patrol: [10, 12]}", TWICE % "from: 2,"),
    "alarm": lambda: lonely("{patrol: [10, 12]}, when: {alarm: {hold: 11}}", ALARM),
    "slack": lambda: lonely("{visit: [10, 16], within: 17}", TIMED),
    "late": lambda: shipped("case_study_1").split("expect:")[0] + "resolve_within: 2\n",
}


def transcript(text: str) -> str:
    trace = _trace(text)
    run = run_of(trace)
    lines = [*_story(text, trace), "", *_page(run), "", *_words(run)]
    plain = re.sub(r" in \d[\d.]* (ms|s)\b| in under 1 ms|, from the cache", "", "\n".join(lines))
    return re.sub(r"\(.*? summed\), .*? total", "(...)", plain) + "\n"


def _trace(text: str) -> Trace:
    return read_bytes(play(text).text.encode())


def _story(text: str, trace: Trace) -> Iterator[str]:
    said: list[str] = []
    story = Story(loaded(text), lambda line: said.append(click.unstyle(str(line))), maps=False)
    for record in (trace.header, *trace.records):
        story(record)
    yield from said


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


@pytest.mark.parametrize("name", CASES)
def test_the_words_of_a_run_stay_the_same(name: str) -> None:
    _golden(transcript(CASES[name]()), f"{name}.txt")


@pytest.mark.parametrize("name", ["door", "zone", "loads", "slow"])
def test_the_picture_of_a_run_stays_the_same(name: str) -> None:
    """Open the file to review it: targets, intentions, names, loads, exclusions, steps, legend."""
    _golden(_picture(run_of(_trace(CASES[name]()))), f"{name}.svg")
