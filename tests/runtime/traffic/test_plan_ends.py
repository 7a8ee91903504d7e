"""Where a joint plan ends: in a live run often with the mission, in lockstep with its first leg."""

import pytest

from runtime.played import completed

SWAP = """
name: swap
map: {{grid: ["#########", "#..###..#", "#.......#", "#..###..#", "#########"]}}
catalogue:
  robots:
    cart: {{mobility: {mobility}, layer: ground, capabilities: [], timing: 1{battery}}}
robots:
  a: {{model: cart, start: [2, 1]{heading}, objective: {first}}}
  b: {{model: cart, start: [2, 7]{heading}, objective: {{visit: [[2, 1], [2, 7]]}}}}
{more}
clock: {clock}
"""
VISIT = "{visit: [[2, 7], [2, 1]]}"
"""Both robots pass the corridor four times, each time in opposite directions."""


@pytest.mark.parametrize(
    ("clock", "change", "one"),
    [
        ("live", {}, True),
        ("live", {"mobility": "heading", "heading": ", heading: east"}, True),
        ("lockstep", {}, False),
        (
            "live",
            {
                "battery": ", battery: {capacity: 200, charge: 9}",
                "more": "chargers: [[1, 1], [1, 7]]",
            },
            False,
        ),
        ("live", {"first": "{ltl: {liveness: [region = 25, region = 19]}}"}, False),
    ],
    ids=["free", "headings", "lockstep", "battery", "formula"],
)
def test_a_plan_leads_through_the_mission(clock: str, change: dict[str, str], one: bool) -> None:
    plain = {"mobility": "free", "battery": "", "heading": "", "first": VISIT, "more": ""}
    run = completed(SWAP.format(clock=clock, **plain | change))
    assert (len(run.all("plan")) == 1) is one
    ends = [line["type"] for line in run.records][-2:]
    assert not one or ends == ["plan_end", "outcome"]  # no strategies for a mission that is over


# walker cannot turn round. West of 13, which it never leaves, cart could not return to 14. Nobody
# knows that walker resolves the crate on its way; then both begin again.
UNKNOWN_CRATE = """
map: {{grid: ["##########", "#........#", "####.#####", "##########"]}}
catalogue:
  robots:
    cart: {{mobility: free, layer: ground, capabilities: []}}
    walker: {{mobility: heading, layer: ground, capabilities: [push]}}
  obstacles: {{crate: {{action: push, resolve_at: [14]}}}}
robots:
  cart: {{model: cart, start: 12, objective: {{visit: [14]}}}}
  walker: {{model: walker, start: 24, heading: west, objective: {{visit: [13]}}}}
obstacles: [{{type: crate, region: 18}}]
until: {{rounds: 1}}
seed: {seed}
"""


@pytest.mark.parametrize("seed", range(3))
def test_a_plan_leads_where_the_rounds_can_restart(seed: int) -> None:
    trace = completed(UNKNOWN_CRATE.format(seed=seed))
    assert trace.one("resolved")["requested"] is False


CHARGES_BELOW = """
map: {grid: ["############", "#..........#", "#####.######", "#..........#", "############"]}
clock: live
catalogue:
  robots:
    slow: {mobility: free, layer: air, capabilities: [], speed: 0.4}
    cart: {mobility: free, layer: ground, capabilities: [], battery: {capacity: 4, charge: 4}}
robots:
  a: {model: slow, start: [1, 3], objective: {once: [[1, 7]]}}
  b: {model: slow, start: [1, 7], objective: {once: [[1, 3]]}}
  c: {model: cart, start: [3, 1], objective: {patrol: [[3, 1], [3, 3]]}}
chargers: [[3, 2]]
until: {rounds: 1}
limits: {ticks: 3000, seconds: 900}
"""


def test_a_plan_goes_on_when_a_robot_of_another_floor_charges() -> None:
    played = completed(CHARGES_BELOW)
    assert played.outcome["rounds"]["c"] > 1
    assert len(played.all("plan")) == 1


CHARGES_ABOVE = """
map: {grid: ["#########", "#.......#", "#####.###", "#########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: []}
    drone: {mobility: free, layer: air, capabilities: [], battery: {capacity: 4, charge: 2}}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[1, 7], [1, 1]]}}
  b: {model: cart, start: [1, 7], objective: {visit: [[1, 1], [1, 7]]}}
  d: {model: drone, start: [1, 1], objective: {visit: [[1, 1], [1, 2]]}}
chargers: [[1, 1]]
until: {rounds: 2}
limits: {ticks: 100}
"""


def test_a_plan_goes_on_when_a_robot_of_another_floor_has_charged() -> None:
    assert {end["reason"] for end in completed(CHARGES_ABOVE).all("plan_end")} == {"reached"}
