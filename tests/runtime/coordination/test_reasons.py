"""What is said where nobody helps: true of the run, each robot named, and the right cause."""

import pytest

from runtime.played import play
from safenav.runtime.duties.reasons import (
    Helper,
    Hindrance,
    Shortfall,
    cause_of,
    shortfall_words,
)
from safenav.scenario.objective import number_word
from safenav.trace.vocabulary import OperatorCause

TEAM = """
safenav: 1
map:
  grid: |
    ###############
    #...#.....#...#
    #.............#
    #...#.....#...#
    ###############
  names: {west: [2, 4], east: [2, 10], a_button: [2, 1], b_button: [2, 13]}
catalogue:
  robots:
    walker: {mobility: free, layer: ground}
    lifter: {mobility: free, layer: ground, capabilities: [lift]}
    red: {mobility: free, layer: ground, capabilities: [red_key]}
    blue: {mobility: free, layer: ground, capabilities: [blue_key]}
  obstacles:
    red_door: {action: red_key, resolve_at: [a_button]}
    blue_door: {action: blue_key, resolve_at: [b_button]}
    crate: {needs: [{action: lift, robots: 2, at: neighbours, together: true}]}
    spill: {action: lift, resolve_at: neighbours}
until: {rounds: 1}
limits: {ticks: 200}
"""
WALKER = "model: walker, start: [1, 5], objective: {visit: [[1, 5], [2, 3]]}"


def test_a_lonely_lifter_is_too_few() -> None:
    trace = play(
        TEAM
        + f"robots: {{w: {{{WALKER}}}, ben: {{model: lifter, start: [3, 5], objective: "
        + "{hold: [3, 5]}}}\nobstacles: [{type: crate, region: west}]\n"
    )
    lacks = "needs two robots with 'lift' at the same time; this team has one: ben"
    assert trace.one("request")["because"] == trace.one("blocked")["because"] == f"it {lacks}"
    assert trace.outcome["cause"] == "no_capable_robot"
    assert f"crate@west {lacks}" in trace.outcome["explanation"]


def test_lifters_without_room_for_both_are_named_with_the_place() -> None:
    trace = play(
        TEAM
        + "robots:\n"
        + "  leo: {model: lifter, start: [2, 3], objective: {visit: [[2, 3], [2, 5]]}}\n"
        + "  mia: {model: lifter, start: [1, 2], objective: {patrol: [[1, 2], [3, 2]]}}\n"
        + "obstacles: [{type: crate, region: west}]\n"
    )
    assert trace.outcome["explanation"] == (
        "crate@west needs two robots with 'lift' at the same time; leo and mia reach only 33 for "
        "it, where there is no room for all of them"
    )


def test_keys_behind_each_other_s_doors_are_a_circle() -> None:
    trace = play(
        TEAM
        + "robots:\n"
        + "  r: {model: red, start: [1, 5], objective: {visit: [[1, 5], [2, 3]]}}\n"
        + "  b: {model: blue, start: [1, 9], objective: {visit: [[1, 9], [2, 11]]}}\n"
        + "obstacles: [{type: red_door, region: east}, {type: blue_door, region: west}]\n"
    )
    assert trace.outcome["cause"] == "cyclic_requests"
    said = trace.outcome["explanation"]
    assert "red_door@east needs a robot with 'red_key'; r has it, but blue_door@west is in" in said
    assert "blue_door@west needs a robot with 'blue_key'; b has it, but red_door@east is in" in said


def test_a_helper_on_another_errand_is_named_with_it() -> None:
    trace = play(
        TEAM
        + f"robots:\n  w: {{{WALKER}, avoids: []}}\n"
        + "  v: {model: walker, start: [1, 9], avoids: [], objective: {visit: [[1, 9], [2, 11]]}}\n"
        + "  spot: {model: lifter, start: [3, 7], avoids: [], objective: {hold: [3, 7]}}\n"
        + "obstacles: [{type: spill, region: west}, {type: spill, region: east}]\n"
        + "order: oldest\n"
    )
    first, second = trace.all("request")[:2]
    assert first["helper"] == "spot"
    assert second["helper"] is None
    assert second["because"] == "spot helps with spill@west"
    assert trace.outcome["outcome"] == "completed"


def lacks(*helpers: Helper, robots: int = 1, of: str = "door@1", **more: bool) -> Shortfall:
    return Shortfall(of, "push", robots, more.get("together", False), helpers)


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


def test_causes_follow_from_what_is_lacking() -> None:
    walled = lacks(Helper("a", Hindrance.WALLS))
    one = lacks(Helper("a", Hindrance.GATES, ("door@2",)))
    other = lacks(Helper("b", Hindrance.GATES, ("door@1",)), of="door@2")
    assert cause_of([walled]) is OperatorCause.NEVER_RESOLVABLE
    assert cause_of([one, lacks(Helper("b", Hindrance.WALLS), of="door@2")]) is (
        OperatorCause.NEVER_RESOLVABLE
    )
    assert cause_of([one, other]) is OperatorCause.CYCLIC_REQUESTS
    assert cause_of([one, other, lacks(robots=2, of="door@3")]) is OperatorCause.NO_CAPABLE_ROBOT
