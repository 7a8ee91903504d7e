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
from safenav.spec.specification import Constraint, Section
from safenav.spec.task import Fairness

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


@dataclass(frozen=True)
class Exercise:
    """A scenario that depends on one rule, what is planted, and how the checker says no."""

    name: str
    grid: str
    robots: str
    planted: Planted
    reason: str
    about: Circumstances = ORDINARY
    more: str = ""


def swapped(first: str, second: str, section: Section) -> Planted:
    def change(constraint: Constraint) -> str:
        if constraint.section is not section:
            return constraint.formula
        text = constraint.formula.replace(first, "\0").replace(second, first)
        return text.replace("\0", second)

    return rewritten(change)


def replaced(old: str, new: str) -> Planted:
    return rewritten(lambda c: new if c.formula == old else c.formula)


ALONE = "a: {model: rover, start: [1, 1], objective: {visit: [[1, 1], [1, 5]]}}"
WALKER = "a: {model: walker, start: [2, 2], heading: east, objective: {visit: [[1, 1], [3, 5]]}}"
TWO = """
    a: {model: rover, start: [1, 1], objective: {visit: [[1, 1], [3, 5]]}}
    b: {model: rover, start: [1, 5], objective: {visit: [[1, 5], [3, 1]]}}
"""
TWO_EXACT = TWO.replace("rover,", "rover, tracking: exact,", 1)
FAIR = Circumstances(fairness=Fairness.OUT_OF_MY_WAY)
EXERCISES = [
    Exercise(
        "a wall left out",
        AROUND_A_WALL,
        ALONE,
        without("region' != 10"),
        "the scenario forbids the edge",
    ),
    Exercise(
        "a turn by 180 degrees allowed",
        OPEN,
        WALKER.replace("[1, 1], [3, 5]", "[2, 1], [2, 5]"),
        rewritten(
            lambda c: c.formula.replace(" & heading != 1", "").replace(" & heading != 3", "")
        ),
        "the scenario forbids the edge",
    ),
    Exercise(
        "turning on the spot allowed",
        OPEN,
        WALKER.replace("[1, 1], [3, 5]", "[2, 1], [2, 5]"),
        without("region' = region -> heading' = heading"),
        "the scenario forbids the edge",
    ),
    Exercise(
        "a target dropped with its memory",
        OPEN,
        ALONE.replace("[1, 5]]", "[1, 5], [3, 3]]"),
        rewritten(
            lambda c: {
                "goal = 1 & region = 12 -> goal' = 2": "goal = 1 & region = 12 -> goal' = 0",
                "goal' = 2 & region' = 24": "TRUE",
            }.get(c.formula, c.formula)
        ),
        "the scenario forbids the edge",
    ),
    Exercise(
        "a target of cover dropped",
        OPEN,
        "a: {model: rover, start: [1, 1], objective: {cover: [[1, 1], [1, 5], [3, 3]]}}",
        without("region' = 24", section=Section.SYS_LIVENESS),
        "goal 2 of the scenario",
    ),
    Exercise(
        "a busy side left out of the rule",
        OPEN,
        TWO,
        without("busy_east' -> move' != 2", "busy_south' -> move' != 3"),
        "the scenario forbids the edge",
        FAIR,
    ),
    Exercise(
        "two busy sides exchanged in the rule",
        OPEN,
        TWO,
        swapped("busy_east", "busy_south", Section.SYS_TRANS),
        "the scenario forbids the edge",
        FAIR,
    ),
    Exercise(
        "fairness FALSE",
        OPEN,
        TWO,
        with_more(Section.ENV_LIVENESS, "FALSE"),
        "goal 0 of the scenario",
        FAIR,
    ),
    Exercise(
        "an assumption that nobody ever comes from one side",
        OPEN,
        TWO,
        with_more(Section.ENV_TRANS, "!busy_east'"),
        "has no answer to",
        FAIR,
    ),
    Exercise(
        "one robot fewer than there are",
        OPEN,
        TWO + "    c: {model: rover, start: [3, 3], objective: {hold: [3, 3]}}\n",
        with_more(Section.ENV_TRANS, "!(busy_east' & busy_south')"),
        "has no answer to",
        FAIR,
    ),
    Exercise(
        "a known obstacle forgotten",
        OPEN,
        ALONE,
        without("region' != 10"),
        "the scenario forbids the edge",
        Circumstances(closed=(10,)),
        "obstacles:\n  - {type: door, region: 10}\n",
    ),
    Exercise(
        "the map's edge wrapped",
        NO_BORDER,
        "a: {model: rover, start: [0, 4], objective: {visit: [[0, 4], [1, 0]]}}",
        without("-> !(region' = region + 1)", "-> !(region = region' + 1)"),
        "the scenario forbids the edge",
    ),
    Exercise(
        "a wrong start heading",
        OPEN,
        WALKER,
        replaced("heading = 1", "heading = 0"),
        "'heading': 0",
    ),
    Exercise(
        "a wrong target to begin with",
        OPEN,
        ALONE,
        replaced("goal = 0", "goal = 1"),
        "'goal': 1",
    ),
    Exercise(
        "the collision rule inverted",
        OPEN,
        TWO,
        rewritten(
            lambda c: (
                f"!{c.formula}"
                if c.section is Section.SYS_TRANS and c.formula.startswith("busy_")
                else c.formula
            )
        ),
        "the robot could continue to",
        FAIR,
    ),
    Exercise(
        "an ltl safety line dropped",
        CROSSROADS,
        "a: {model: rover, start: [1, 1], objective: {ltl: {\n"
        '        safety: ["region\' != 7"], liveness: ["region\' = 8", "region\' = 6"]}}}',
        without("region' != 7"),
        "the scenario forbids the edge",
    ),
    Exercise(
        "an ltl goal dropped",
        OPEN,
        'a: {model: rover, start: [1, 1], objective: {ltl: {liveness: ["region\' = 12"]}}}',
        without("region' = 12", section=Section.SYS_LIVENESS),
        "goal 0 of the scenario",
    ),
    Exercise(
        "a belief that vanishes",
        AROUND_A_WALL,
        """
    a: {model: rover, tracking: belief, vision: 2, start: [1, 1], objective: {hold: [1, 1]}}
    b: {model: rover, start: [1, 5], objective: {visit: [[1, 5], [2, 4]]}}
""",
        with_more(Section.ENV_TRANS, "at_b' < 28"),
        "has no answer to",
    ),
    Exercise(
        "crossing the other target allowed to a patrol",
        CROSSROADS,
        "a: {model: rover, start: [1, 1], objective: {patrol: [[1, 2], [1, 3]]}}",
        without("!(region' = 7 & scout')", "!(region' = 8 & !scout')"),
        "the scenario forbids the edge",
        Circumstances(memory=Memory(1)),
    ),
    Exercise(
        "a robot that holds may leave again",
        OPEN,
        "a: {model: rover, start: [1, 2], objective: {hold: {any: [[1, 1], [1, 2]]}}}",
        without("region = 8 -> region' = 8", "region = 9 -> region' = 9"),
        "the scenario forbids the edge",
    ),
    Exercise(
        "exact positions ignored",
        OPEN,
        TWO_EXACT,
        without("region' != at_b'"),
        "the scenario forbids the edge",
        FAIR,
    ),
    Exercise(
        "others taken to stand still",
        OPEN,
        TWO_EXACT,
        with_more(Section.ENV_TRANS, "at_b' = at_b"),
        "has no answer to",
        FAIR,
    ),
    Exercise(
        "a robot told to wait may go on",
        OPEN,
        ALONE,
        without("wait' -> region' = region"),
        "the scenario forbids the edge",
        Circumstances(assignable=True),
    ),
    Exercise(
        "a robot on its way that cannot be stopped",
        OPEN,
        ALONE,
        with_more(Section.ENV_TRANS, "request & request' -> !wait'"),
        "has no answer to",
        Circumstances(assignable=True),
    ),
    Exercise(
        "a request that need not be answered",
        OPEN,
        ALONE,
        without("request' & !wait' -> region' = assigned'"),
        "goal 1 of the scenario",
        Circumstances(assignable=True),
    ),
    Exercise(
        "a place to which nobody can be sent",
        OPEN,
        ALONE,
        with_more(Section.ENV_TRANS, "assigned' != 24"),
        "has no answer to",
        Circumstances(assignable=True),
    ),
]


@pytest.mark.parametrize("exercise", EXERCISES, ids=lambda e: e.name)
def test_a_planted_error_is_caught(exercise: Exercise, tmp_path: Path) -> None:
    scenario = scenario_of(exercise.grid, exercise.robots, exercise.more)
    assert verdict_of(scenario, tmp_path / "right", exercise.about) == ""
    said = verdict_of(scenario, tmp_path / "wrong", exercise.about, exercise.planted)
    assert exercise.reason in said
