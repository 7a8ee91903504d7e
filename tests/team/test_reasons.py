"""The reasons why no robot helps, and why a run ends: each robot is named."""

from pathlib import Path

import pytest

from safenav.runtime.run.mission import Mission
from safenav.scenario.objective import number_word
from safenav.scenario.reading.loader import load_scenario_text
from safenav.solve.reasons import (
    Helper,
    Hindrance,
    Shortfall,
    shortfall_words,
)


def lacks(*helpers: Helper, robots: int = 1) -> Shortfall:
    return Shortfall("door@1", "push", robots, False, helpers)


@pytest.mark.parametrize(
    ("hindrance", "but"),
    [
        (Hindrance.WALLS, "no path leads there"),
        (Hindrance.GATES, "door@1 itself is in the way"),
        (
            Hindrance.INSIDE,
            "one robot alone cannot enter that region; 'at' of the need can name other regions",
        ),
        (Hindrance.OUT_OF_SERVICE, "it is out of service"),
    ],
)
def test_the_reason_names_what_keeps_a_robot_from_an_obstacle(
    hindrance: Hindrance, but: str
) -> None:
    gates = ("door@1",) if hindrance in (Hindrance.GATES, Hindrance.INSIDE) else ()
    said = shortfall_words(lacks(Helper("a", hindrance, gates)), number_word)
    assert said == f"door@1 needs a robot with 'push'; a has it, but {but}"


TWO = (Helper("a", Hindrance.NOTHING), Helper("b", Hindrance.GATES, ("crate@2",)))


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lacks(), "door@1 needs a robot with 'push', and no robot of this team has it"),
        (
            lacks(*TWO, robots=2),
            "door@1 needs two robots with 'push'; b has it, but crate@2 is in the way; "
            "a can reach it",
        ),
        (
            lacks(*(Helper(each, Hindrance.OUT_OF_SERVICE) for each in "ab"), TWO[1]),
            "door@1 needs a robot with 'push'; a and b have it, but they are out of service; "
            "b has it, but crate@2 is in the way",
        ),
        (
            Shortfall("door@1", "push", 2, False, (), ("sense",), ("a",)),
            "door@1 needs two robots with 'push' ('sense' is fulfilled, 'push' is open); this team "
            "has one: a; a has done it",
        ),
        (
            Shortfall("box@1", "lift", 1, False, (), beside=("press",)),
            "box@1 needs a robot with 'lift' and 'press', and no robot of this team has both",
        ),
    ],
)
def test_the_reason_names_the_robots_that_a_need_lacks(found: Shortfall, words: str) -> None:
    assert shortfall_words(found, number_word) == words


CASES = Path(__file__).parents[1] / "runtime" / "cases"
ENDS = {
    "requests/wait_for_each_other": (
        "cyclic_requests",
        ("rover", "quad"),
        "uncertainty@14 needs a robot with 'sense'; quad has it, but door@17 is in the way",
    ),
    "requests/button_behind_its_gate": (
        "cyclic_requests",
        ("a",),
        "gate@10 needs a robot with 'press'; a has it, but gate@10 itself is in the way",
    ),
    "requests/between_walls": (
        "unrealizable",
        ("digit",),
        "digit cannot visit 12, 8 in turn: there is no path from 9 [1, 2] to 12 [1, 5] and "
        "8 [1, 1]: 10 [1, 3] is closed (found to be untraversable)",
    ),
}


@pytest.mark.parametrize("name", ENDS)
def test_an_end_names_its_cause_and_the_robots_that_are_stuck(name: str) -> None:
    cause, stuck, link = ENDS[name]
    text = (CASES / f"{name}.yaml").read_text()
    scenario = load_scenario_text(text if "safenav: 1" in text else f"safenav: 1\n{text}")
    result = Mission(scenario).run()
    assert (result.cause, result.stuck) == (cause, stuck)
    assert link in result.links and result.explanation == "; ".join(result.links)
