"""Searches for joint plans: what ends them, and where robots with batteries may step; and why no
plan helps."""

import pytest

from safenav import load_scenario_text
from safenav.plan.ask import ask_charged
from safenav.plan.charged import ChargedSearch
from safenav.plan.search import STATIC, Search
from safenav.scenario.objective import number_word
from safenav.solve.reasons import Helper, Hindrance, Shortfall, shortfall_words
from safenav.team.apply import initial
from safenav.team.floor import Floor, floor_now
from safenav.team.team import team_of

FACING = """
safenav: 1
map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
robots:
  a: {model: digit, start: 8, heading: east, objective: {visit: [8, 12]}}
  b: {model: digit, start: 12, heading: west, objective: {visit: [12, 8]}}
"""
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


def floor_of(text: str) -> Floor:
    team = team_of(load_scenario_text(text))
    return floor_now(team, initial(team))


def test_robots_that_face_each_other_never_move_again() -> None:
    floor = floor_of(FACING)
    size = floor.graphs[0].size
    start = floor.begun((size + 8, 3 * size + 12), ((0, 0),) * 2, ())
    search = Search(floor, frozenset(), lambda *_: (None,) * 2, start, 1, 1000)

    def jammed(*poses: tuple[str, int]) -> bool:
        numbers = tuple({"east": 1, "west": 3}[heading] * size + at for heading, at in poses)
        return search._is_jammed(start._replace(poses=numbers))

    assert jammed(("east", 9), ("west", 10))
    assert not jammed(("east", 9), ("west", 11)), "one region is between them"
    assert not jammed(("west", 9), ("west", 10)), "one follows the other"


def test_searches_with_charges_end_when_their_check_raises() -> None:
    floor, left = floor_of(CHARGED), iter(range(5))
    start = floor.begun((0, 2, 3), ((0, 0),) * 3, ())
    with pytest.raises(StopIteration):
        ask_charged(floor, start, (), 1, (30.0,) * 3, 0, lambda: next(left))


def test_charged_robots_never_step_into_one_region_nor_exchange_theirs() -> None:
    floor = floor_of(CHARGED)
    start = floor.begun((0, 2, 3), ((0, 0),) * 3, ())._replace(charges=(30.0,) * 3)
    how = (False, False)
    search = ChargedSearch(floor, frozenset(), lambda *_: (None,) * 3, start, 1, 1000, how)
    found, left = {start.poses}, [start]
    while left:
        joint = left.pop()
        for after in search._next(joint, STATIC, [0, 1, 2]):
            assert len({*after.poses}) == 3, after.poses
            pairs = zip(joint.poses, after.poses, strict=True)
            steps = {pair for pair in pairs if pair[0] != pair[1]}
            assert not steps & {(q, p) for p, q in steps}, steps
            if after.poses not in found:
                found.add(after.poses)
                left.append(after)
    assert len(found) > 9


def test_robots_that_have_done_their_part_and_those_out_of_service_are_named() -> None:
    """What else keeps robots from an obstacle: ``cli/transcripts/reasons.txt``."""
    out = [Helper(each, Hindrance.OUT_OF_SERVICE) for each in "ab"]
    beyond = Helper("c", Hindrance.GATES, ("crate@2",))
    several = Shortfall("door@1", "push", 1, False, (*out, beyond))
    assert shortfall_words(several, number_word) == (
        "door@1 needs a robot with 'push'; a and b have it, but they are out of service; c has it, "
        "but crate@2 is in the way"
    )
    begun = Shortfall("door@1", "push", 2, False, out[:1], ("sense",), ("b",))
    assert shortfall_words(begun, number_word) == (
        "door@1 needs two robots with 'push' (after 'sense'); b has done "
        "it; a has it, but it is out of service"
    )
