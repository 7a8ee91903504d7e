"""What is said where nobody helps: each robot is named."""

import pytest

from safenav.runtime.duties.reasons import (
    Helper,
    Hindrance,
    Shortfall,
    shortfall_words,
)
from safenav.scenario.objective import number_word


def lacks(*helpers: Helper, robots: int = 1) -> Shortfall:
    return Shortfall("door@1", "push", robots, False, helpers)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lacks(), "door@1 needs a robot with 'push', and no robot of this team has it"),
        (
            lacks(Helper("a", Hindrance.WALLS)),
            "door@1 needs a robot with 'push'; a has it, but no path leads there",
        ),
        (
            lacks(
                Helper("a", Hindrance.NOTHING),
                Helper("b", Hindrance.GATES, ("crate@2",)),
                robots=2,
            ),
            "door@1 needs two robots with 'push'; b has it, but crate@2 is in its way; "
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
        (
            lacks(Helper("a", Hindrance.GATES, ("door@1",))),
            "door@1 needs a robot with 'push'; a has it, but it cannot enter that region alone: "
            "'at' can say where else it acts",
        ),
        (
            lacks(Helper("a", Hindrance.OUT_OF_SERVICE)),
            "door@1 needs a robot with 'push'; a has it, but it is out of service",
        ),
    ],
)
def test_what_an_obstacle_lacks_is_said_of_each_robot(found: Shortfall, words: str) -> None:
    assert shortfall_words(found, number_word) == words
