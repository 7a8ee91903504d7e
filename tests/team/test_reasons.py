"""The reasons why no robot helps: each robot is named."""

import pytest

from safenav.scenario.objective import number_word
from safenav.solve.reasons import Helper, Hindrance, Shortfall, shortfall_words


def lacks(*helpers: Helper, robots: int = 1) -> Shortfall:
    return Shortfall("door@1", "push", robots, False, helpers)


DOOR = ("door@1",)
TWO = (Helper("a", Hindrance.NOTHING), Helper("b", Hindrance.GATES, ("crate@2",)))
OUT = [Helper(each, Hindrance.OUT_OF_SERVICE) for each in "ab"]


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lacks(Helper("a", Hindrance.WALLS)), "; a has it, but no path leads there"),
        (lacks(Helper("a", Hindrance.GATES, DOOR)), "; a has it, but door@1 itself is in the way"),
        (
            lacks(Helper("a", Hindrance.INSIDE, DOOR)),
            "; a has it, but one robot alone cannot enter that region; 'at' of the need can name "
            "other regions",
        ),
        (lacks(OUT[0]), "; a has it, but it is out of service"),
        (lacks(), ", and no robot of this team has it"),
        (
            lacks(*OUT, TWO[1]),
            "; a and b have it, but they are out of service; b has it, but crate@2 is in the way",
        ),
    ],
)
def test_the_reason_names_what_keeps_robots_from_an_obstacle(found: Shortfall, words: str) -> None:
    assert shortfall_words(found, number_word) == f"door@1 needs a robot with 'push'{words}"


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (
            lacks(*TWO, robots=2),
            "door@1 needs two robots with 'push'; b has it, but crate@2 is in the way; "
            "a can reach it",
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
