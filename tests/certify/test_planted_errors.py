"""Errors planted in the compiler: the strategy realizes its specification, but not the scenario.

Each is caught by the checker although the verifier accepts the strategy, and the same scenario
without the error is accepted.
"""

from dataclasses import dataclass
from pathlib import Path

import pytest

from certify.tasks import (
    ORDINARY,
    Circumstances,
    Planted,
    rewritten,
    scenario_of,
    verdict_of,
    with_more,
    without,
)
from safenav.spec.objective import Memory
from safenav.spec.specification import Section

AROUND_A_WALL = """
    #######
    #..#..#
    #.....#
    #######
"""
OPEN = """
    #######
    #.....#
    #.....#
    #.....#
    #######
"""
NO_BORDER = """
    .....
    .###.
    .....
"""
CROSSROADS = """
    #####
    #...#
    #.#.#
    #...#
    #####
"""


EDGE = "the scenario forbids the edge"
UNANSWERED = "has no successor for"


@dataclass(frozen=True)
class Exercise:
    """A scenario that depends on one rule, what is planted, and how the checker says no."""

    name: str
    robots: str
    planted: Planted
    reason: str = EDGE
    about: Circumstances = ORDINARY
    grid: str = OPEN
    more: str = ""


def replaced(old: str, new: str) -> Planted:
    return rewritten(lambda c: new if c.formula == old else c.formula)


ALONE = "a: {model: rover, start: [1, 1], objective: {visit: [[1, 1], [1, 5]]}}"
WALKER = "a: {model: walker, start: [2, 2], heading: east, objective: {visit: [[1, 1], [3, 5]]}}"
TRACKING = """
    a: {model: rover, tracks: [b], start: [1, 1],
        objective: {visit: [[1, 1], [3, 5]]}}
    b: {model: quadcopter, start: [1, 5], objective: {visit: [[1, 5], [3, 1]]}}
"""
EXERCISES = [
    Exercise("a wall left out", ALONE, without("region' != 10"), grid=AROUND_A_WALL),
    Exercise(
        "a turn by 180 degrees allowed",
        WALKER.replace("[1, 1], [3, 5]", "[2, 1], [2, 5]"),
        rewritten(
            lambda c: c.formula.replace(" & heading != 1", "").replace(" & heading != 3", "")
        ),
    ),
    Exercise(
        "turning on the spot allowed",
        WALKER.replace("[1, 1], [3, 5]", "[2, 1], [2, 5]"),
        without("region' = region -> heading' = heading"),
    ),
    Exercise(
        "a target of visit dropped",
        ALONE.replace("[1, 5]]", "[1, 5], [3, 3]]"),
        without("region' = 24", section=Section.SYS_LIVENESS),
        "goal 2 of the scenario",
    ),
    Exercise(
        "a target of cover dropped",
        "a: {model: rover, start: [1, 1], objective: {cover: [[1, 1], [1, 5], [3, 3]]}}",
        without("region' = 24", section=Section.SYS_LIVENESS),
        "goal 2 of the scenario",
    ),
    Exercise(
        "a known obstacle forgotten",
        ALONE,
        without("region' != 10"),
        about=Circumstances(closed=(10,)),
        more="obstacles:\n  - {type: door, region: 10}\n",
    ),
    Exercise(
        "the map's edge wrapped",
        "a: {model: rover, start: [0, 4], objective: {visit: [[0, 4], [1, 0]]}}",
        without("-> !(region' = region + 1)", "-> !(region = region' + 1)"),
        grid=NO_BORDER,
    ),
    Exercise(
        "a wrong start heading", WALKER, replaced("heading = 1", "heading = 0"), "'heading': 0"
    ),
    Exercise(
        "a wrong target to begin with",
        ALONE.replace("visit", "patrol"),
        replaced("!scout", "scout"),
        "'scout': 1",
    ),
    Exercise(
        "an ltl safety line dropped",
        "a: {model: rover, start: [1, 1], objective: {ltl: {\n"
        '        safety: ["region\' != 7"], liveness: ["region\' = 8", "region\' = 6"]}}}',
        without("region' != 7"),
        grid=CROSSROADS,
    ),
    Exercise(
        "an ltl goal dropped",
        'a: {model: rover, start: [1, 1], objective: {ltl: {liveness: ["region\' = 12"]}}}',
        without("region' = 12", section=Section.SYS_LIVENESS),
        "goal 0 of the scenario",
    ),
    Exercise(
        "a belief that vanishes",
        """
    a: {model: rover, tracks: [b], vision: 2, start: [1, 1],
        objective: {hold: [1, 1]}}
    b: {model: quadcopter, start: [1, 5], objective: {visit: [[1, 5], [2, 4]]}}
""",
        with_more(Section.ENV_TRANS, "at_b' < 28"),
        UNANSWERED,
        grid=AROUND_A_WALL,
    ),
    Exercise(
        "crossing the other target allowed to a patrol",
        "a: {model: rover, start: [1, 1], objective: {patrol: [[1, 2], [1, 3]]}}",
        without("!(region' = 7 & scout')", "!(region' = 8 & !scout')"),
        about=Circumstances(memory=Memory(1)),
        grid=CROSSROADS,
    ),
    Exercise(
        "a robot that holds may leave again",
        "a: {model: rover, start: [1, 2], objective: {hold: {any: [[1, 1], [1, 2]]}}}",
        without("region = 8 -> region' = 8", "region = 9 -> region' = 9"),
    ),
    Exercise(
        "others taken to stand still",
        TRACKING,
        with_more(Section.ENV_TRANS, "at_b' = at_b"),
        UNANSWERED,
    ),
    Exercise(
        "a robot told to wait may go on",
        ALONE,
        without("wait' -> region' = region"),
        about=Circumstances(assignable=True),
    ),
    Exercise(
        "a robot on its way that cannot be stopped",
        ALONE,
        with_more(Section.ENV_TRANS, "request & request' -> !wait'"),
        UNANSWERED,
        Circumstances(assignable=True),
    ),
    Exercise(
        "a request that need not be answered",
        ALONE,
        without("request' & !wait' -> region' = assigned'"),
        "goal 1 of the scenario",
        Circumstances(assignable=True),
    ),
    Exercise(
        "a place to which nobody can be sent",
        ALONE,
        with_more(Section.ENV_TRANS, "assigned' != 24"),
        UNANSWERED,
        Circumstances(assignable=True),
    ),
]


@pytest.mark.parametrize("exercise", EXERCISES, ids=lambda e: e.name)
def test_a_planted_error_is_caught(exercise: Exercise, tmp_path: Path) -> None:
    scenario = scenario_of(exercise.grid, exercise.robots, exercise.more)
    assert verdict_of(scenario, tmp_path / "right", exercise.about) == ""
    said = verdict_of(scenario, tmp_path / "wrong", exercise.about, exercise.planted)
    assert exercise.reason in said
