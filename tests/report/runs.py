"""The runs that pages, pictures and transcripts show, by name; each is played once."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from once import SCENARIOS, beside, made_once
from runtime.played import play
from safenav import motion_of, read_run, read_trace
from safenav.report.page.html import page_of_trace
from safenav.report.page.motion import page3d_of
from safenav.run.run import Run
from support import damage


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

TOLD: dict[str, Callable[[], str]] = {
    "door": lambda: shipped("case_study_1"),
    "chain": lambda: shipped("case_study_3"),
    "beliefs": lambda: shipped("case_study_1_beliefs"),
    "joint_plan": lambda: shipped("corridor_swap"),
    "loads": lambda: shipped("warehouse_orders"),
    "detour": lambda: own("scouting"),
    "meeting": lambda: own("meeting"),
    "slow": lambda: own("slow"),
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
"""Those that have a transcript."""
OTHERS: dict[str, Callable[[], str]] = {
    "crowd": lambda: own("crowd"),
    "clinic": lambda: own("clinic"),
    "hospital": lambda: shipped("hospital"),
}


def text_of(name: str) -> str:
    return (TOLD | OTHERS)[name]()


@cache
def trace_of(name: str) -> Path:
    def make(folder: Path) -> None:
        (folder / f"{name}.jsonl").write_text("".join(play(text_of(name)).lines))

    return made_once(f"run {name}", make) / f"{name}.jsonl"


@cache
def run_of(name: str) -> Run:
    return read_run(trace_of(name))


@cache
def page_of(name: str) -> Path:
    return made_once(f"page of {name}", lambda at: paged(trace_of(name), at)) / "page.html"


@cache
def solid_page_of(name: str) -> str:
    trace = read_trace(trace_of(name))
    return page3d_of(trace, trace.source, motion_of(trace))


def paged(trace: Path, folder: Path) -> Path:
    """The page of a trace, in a folder."""
    page = folder / "page.html"
    page.write_text(page_of_trace(read_trace(trace), trace.name))
    return page


def changed(name: str, edits: Sequence[damage.Edit], folder: Path) -> Path:
    """The trace of a run after these edits."""
    lines = damage.damage(damage.read(trace_of(name)), edits)
    trace = folder / "changed.jsonl"
    trace.write_text("\n".join(damage.text(lines)) + "\n")
    return trace
