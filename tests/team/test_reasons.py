"""The reasons why no robot helps, and why a run ends: each robot is named."""

import pytest

from runtime.facts import case
from runtime.played import loaded
from safenav.runtime.run.mission import Mission
from safenav.scenario.objective import number_word
from safenav.solve.reasons import Helper, Hindrance, Shortfall, shortfall_words


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
def test_the_reason_names_the_cause_that_keeps_a_robot_from_an_obstacle(
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


def test_the_result_of_a_run_names_the_immobile_robots() -> None:
    mission = Mission(loaded(case("requests/wait_for_each_other")))
    result = mission.run()
    assert mission.end is not None
    assert (result.cause, mission.end.stuck) == ("cyclic_requests", ("rover", "quad"))
    assert result.explanation == "; ".join(mission.end.links)
