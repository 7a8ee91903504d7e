"""Runs that are cut off, and small scenarios to cut."""

from collections.abc import Iterable

from safenav.begun import Begun
from safenav.runtime.analysis.resuming import resumed
from safenav.scenario.reading.joining import joined

from runtime.played import Line, Run, prepared
from safenav.audit.check import audit
from safenav.scenario.model import Scenario
from safenav.trace.reading import read_lines


def begun(rest: Scenario) -> Begun:
    assert rest.begun is not None
    return rest.begun


def continued(run: Run, end: int, scenario: Scenario | None = None) -> Run:
    """Return the rest of a run that is cut there. The audit derives the header of the rest by its
    own replay of the first run."""
    first = read_lines(run.lines[:end])
    mission, rest = prepared(resumed(first, scenario))
    mission.run()
    assert audit(read_lines(rest.lines), first).findings == (), end
    return rest


def with_another(rest: Scenario) -> Scenario:
    """The rest with a robot that joins the team where no other is."""
    place = min({*rest.map.free} - {robot.start.region for robot in rest.robots})
    return joined(rest, f"bee: {{model: quadcopter, start: {place}, objective: {{hold: {place}}}}}")


def moves(records: Iterable[Line]) -> list[tuple[str, int, int, str]]:
    keys = "robot", "from", "to", "by"
    return [tuple(one[key] for key in keys) for one in records if one["type"] == "move"]


def goals(records: Iterable[Line]) -> list[tuple[str, int, int]]:
    return [(one["robot"], one["goal"], one["round"]) for one in records if one["type"] == "goal"]


REMEMBERS = """
map: {grid: [".......", "......."]}
robots:
  r:
    model: husky
    start: 0
    objective:
      ltl: {memory: %s, init: %s, safety: %s, liveness: %s}
inputs: {alarm: {at: ["3-6"]}}
"""


FORMULAS = {
    "flag": ({"m": "bool"}, "!m", ["m' <-> m | region = 6", "region' = 7 -> m'"], ["region = 7"]),
    "toggle": (
        {"m": "bool"},
        "!m",
        ["region' = 6 -> m'", "region' = 7 -> !m'", "region' != 6 & region' != 7 -> (m' <-> m)"],
        ["region = 6", "region = 7"],
    ),
    "input": ({"m": "bool"}, "!m", ["m' <-> m | alarm'"], ["region = 7", "region = 6"]),
    "range": (
        {"c": [0, 2]},
        "c = 0",
        [f"region' = 3 & region != 3 & c = {k} -> c' = {(k + 1) % 3}" for k in range(3)]
        + ["!(region' = 3 & region != 3) -> c' = c"],
        ["c = 2 & region = 5"],
    ),
}


ONE = """
map: {grid: [".....", "....."]}
robots: {r: {model: husky, start: 0, objective: {%s}}}
until: {rounds: 3}
"""


KINDS = {
    "visit": "visit: [2, 6, 4], within: 14",
    "patrol": "patrol: [2, 8], within: 9",
    "circuit": "patrol: [1, 5, 9]",
    "cover": "cover: [2, 8, 5]",
    "once": "once: [8, 1, 5]",
    "hold": "hold: 7",
    "shared": "visit: [{any: [2, 3]}, {any: [3, 7]}, 5]",
    "shared once": "once: [{any: [2, 3]}, {any: [3, 7]}, 5]",
}


TIGHT = """
map: {grid: ["#....#", "######", "......", "######", "......"]}
robots:
  a: {model: husky, start: 1, objective: {visit: [4, 1], within: 6}}
  b: {model: husky, start: 12, objective: {visit: [17, 12], within: 10}}
  c: {model: husky, start: 24, objective: {cover: [29, 24]}}
until: {rounds: 2, by: %d}
late: stop
"""


DUE = """
map: {grid: ["..........", "##########"]}
robots: {r: {model: husky, start: 0, objective: {visit: [9, 0]}}}
until: {rounds: 1, by: %d}
late: %s
"""
