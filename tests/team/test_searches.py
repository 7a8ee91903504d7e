"""Searches for joint plans: what ends them; and why no plan helps."""

import pytest
from msgspec.structs import replace

from safenav import load_scenario_text
from safenav.plan.ask import ask_charged, lost
from safenav.plan.order import joint_now
from safenav.scenario.objective import number_word
from safenav.solve.reasons import Helper, Hindrance, Shortfall, shortfall_words
from safenav.team.apply import initial
from safenav.team.known import floor_now
from safenav.team.team import Need, team_of

CHARGED = """
safenav: 1
map: {grid: ["....", ".##."]}
chargers: [4]
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [],
           battery: {capacity: 30, start: 30, move: 1, stay: 0, charge: 5}}
robots:
  a: {model: cart, start: 0, objective: {visit: [0, 3]}}
  b: {model: cart, start: 2, objective: {visit: [2, 0]}}
  c: {model: cart, start: 3, objective: {visit: [3, 7]}}
"""

ZONE = """
safenav: 1
map: {grid: ["..."]}
catalogue: {robots: {drone: {mobility: free, layer: air, capabilities: []}}}
robots:
  a: {model: drone, avoids: [], start: 0, objective: {visit: [2]}}
  b: {model: drone, avoids: [], start: 2, objective: {visit: [0]}}
  c: {model: drone, avoids: [], start: 1, objective: {visit: [2]}}
never_together: [{robots: [a, b, c], in: [1]}]
"""


def test_searches_with_charges_end_when_their_check_raises() -> None:
    team = team_of(load_scenario_text(CHARGED))
    floor, left = floor_now(team, initial(team)), iter(range(5))
    start = floor.settled((0, 2, 3), ((0, 0),) * 3, ())
    with pytest.raises(StopIteration):
        ask_charged(floor, start, (), 1, (30.0,) * 3, 0, False, lambda: next(left))


def test_a_proof_for_a_few_robots_does_not_assume_that_another_stays_in_their_zone() -> None:
    team = team_of(load_scenario_text(ZONE))
    state = initial(team)
    floor = floor_now(team, state)
    assert lost(floor, joint_now(state, floor), [0, 1]) is None


def test_reasons_name_robots_that_are_out_of_service_or_did_their_part() -> None:
    """What else keeps robots from an obstacle: ``cli/transcripts/reasons.txt``."""
    out = [Helper(each, Hindrance.OUT_OF_SERVICE) for each in "ab"]
    beyond = Helper("c", Hindrance.GATES, ("crate@2",))
    alone = Need("push", 1, 0, False, False, False, frozenset({"push"}), frozenset(), frozenset())
    several = Shortfall("door@1", alone, (*out, beyond))
    assert shortfall_words(several, number_word) == (
        "door@1 needs a robot with 'push'; a and b have it, but they are out of service; c has it, "
        "but crate@2 is in the way"
    )
    begun = Shortfall("door@1", replace(alone, robots=2), out[:1], ("sense",), ("b",))
    assert shortfall_words(begun, number_word) == (
        "door@1 needs two robots with 'push' (after 'sense'); b has done "
        "it; a has it, but it is out of service"
    )
