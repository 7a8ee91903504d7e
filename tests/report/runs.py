"""The runs that pages, pictures and transcripts show, by name: each is played once by the command,
which tells its story meanwhile."""

import json
import re
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from once import SCENARIOS, beside, made_once
from safenav import check_trace, read_run
from support import damage
from warm import safenav


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


TWICE = "obstacles: [{type: door, region: 22, from: 8, until: 10}, {type: door, region: 22, %s \
until: 5}]\nuntil: {rounds: 4}"
ALARM = "inputs: {alarm: {at: [3-8]}}\nuntil: {rounds: 3}"
TIMED = "until: {rounds: 2, by: 60}\nlate: go_on"

TOLD: dict[str, Callable[[], str]] = {
    "door": lambda: shipped("case_study_1"),
    "chain": lambda: shipped("case_study_3"),
    "beliefs": lambda: shipped("case_study_1_beliefs"),
    "joint_plan": lambda: shipped("corridor_swap"),
    "loads": lambda: shipped("warehouse_orders"),
    "detour": lambda: own("scouting"),
    "meeting": lambda: own("meeting"),
    "slow": lambda: own("slow"),
    "stopped": lambda: own("stopped"),
    "live": lambda: own("live"),
    "itself": lambda: own("itself"),
    "charges": lambda: own("cart"),
    "battery": lambda: shipped("battery_delivery"),
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
"""Those that have a transcript."""
OTHERS: dict[str, Callable[[], str]] = {
    "room": lambda: own("room"),
    "crowd": lambda: own("crowd"),
    "clinic": lambda: own("clinic"),
    "hospital": lambda: shipped("hospital"),
    "shut": lambda: lonely("{visit: [10, 16]}", "obstacles: [{type: door, region: 22, until: 20}]"),
}


def text_of(name: str) -> str:
    return (TOLD | OTHERS)[name]()


@cache
def _played(name: str) -> Path:
    """The folder of a run: its trace, which the judge accepts, and its story."""

    def make(folder: Path) -> None:
        scenario, trace = folder / "scenario.yaml", folder / f"{name}.jsonl"
        scenario.write_text(text_of(name))
        told = safenav("run", scenario, "--trace", trace, "--no-map")
        assert check_trace(trace).findings == (), told.stderr
        (folder / "story.txt").write_text(told.stdout)

    return made_once(f"run {name}", make)


def trace_of(name: str) -> Path:
    return _played(name) / f"{name}.jsonl"


def story_of(name: str) -> str:
    return (_played(name) / "story.txt").read_text()


@cache
def run_of(name: str) -> Any:
    return read_run(trace_of(name))


@cache
def page_of(name: str, *more: str) -> Path:
    """The page of a run; ``--3d``: in three dimensions."""

    def make(folder: Path) -> None:
        paged(trace_of(name), folder, *more)

    return made_once(" ".join(["page of", name, *more]), make) / "page.html"


def paged(trace: Path, folder: Path, *more: str) -> Path:
    """The page of a trace, in a folder."""
    page = folder / "page.html"
    done = safenav("replay", trace, "-o", page, *more)
    assert done.returncode == 0, done.stderr
    return page


def data_of(page: Path, name: str = "run") -> Any:
    """The data of a page."""
    (found,) = re.findall(f'id="{name}">(.*?)</script>', page.read_text())
    return json.loads(found)


def picture_of(name: str, folder: Path, *more: str, form: str = "svg") -> Path:
    """The picture of a moment of a run, or its film."""
    picture = folder / f"picture.{form}"
    done = safenav("replay", trace_of(name), "-o", picture, *more)
    assert done.returncode == 0, done.stderr
    return picture


def changed(name: str, edits: Sequence[damage.Edit], folder: Path) -> Path:
    """The trace of a run after these edits."""
    lines = damage.damage(damage.read(trace_of(name)), edits)
    trace = folder / "changed.jsonl"
    trace.write_text("\n".join(damage.text(lines)) + "\n")
    return trace
