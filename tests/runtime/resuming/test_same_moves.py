"""The rest of a run moves as the whole run does from there, where that is determined."""

import json
from collections.abc import Iterable

import pytest

from runtime.played import Line, loaded, play
from runtime.resuming.cuts import continued

CHARGES = """
map: {grid: ["......."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, battery: {capacity: 9, charge: 2, start: 2}}}
robots:
  c: {model: cart, start: 0, objective: {visit: [1, 0]}}
  d: {model: husky, start: 6, objective: {hold: 6}}
chargers: [0]
until: {rounds: 3}
"""
"""Among others a robot charges more than it needs for its next target."""
CHARGES_BESIDE = """
map: {grid: ["......."]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, battery: {capacity: 12, charge: 3, stay: 1, start: 9}}
robots:
  c: {model: cart, start: 1, objective: {visit: [5, 1]}}
  d: {model: quadcopter, start: 6, objective: {visit: [5, 6]}}
chargers: [0]
until: {rounds: 1}
"""
"""A tick in which only some robots have had their turn costs no charge twice."""
CALLED_AWAY = """
map: {grid: ["......"]}
robots:
  q:
    model: quadcopter
    start: 0
    objective: {visit: [0, 3, {any: [1, 2]}]}
    when: {alarm: {visit: [5, 3]}}
inputs: {alarm: {at: ["2-5"]}}
"""
"""Targets of its own objective that it crosses while an input gives it another do not count."""
COMES_LATER = """
map: {grid: ["....", "####", "...."]}
robots:
  a: {model: digit, start: 1, heading: south, objective: {hold: 1}}
  b: {model: husky, start: 8, objective: {visit: [11, 8]}}
changes:
  - {at: 3, robot: a, objective: {visit: [0, 3]}}
  - {at: 6, robot: a, objective: {hold: 1}}
until: {rounds: 1}
"""
"""A robot that cannot go on before the scenario changes something waits for that."""

HELD = """
map: {grid: ["....."]}
robots:
  a: {model: husky, start: 0, objective: {hold: 0}}
  b: {model: husky, start: 4, objective: {visit: [3, 4]}}
changes: [{at: 7, robot: a, objective: {hold: 2}}]
until: {rounds: 4}
"""
"""A robot that has held its place has not waited for the target that it gets then."""

CHARGES_ON_THE_WAY = """
map: {grid: ["#######", "#.....#", "#...#.#", "#######"]}
catalogue:
  robots: {cart: {mobility: heading, layer: air, battery: {capacity: 22, charge: 1}}}
robots: {c: {model: cart, start: 19, heading: north, objective: {patrol: [8, 9]}}}
chargers: [19, 16, 15]
until: {rounds: 2}
"""


def moves(records: Iterable[Line]) -> list[tuple[str, int, int, str]]:
    keys = "robot", "from", "to", "by"
    return [tuple(one[key] for key in keys) for one in records if one["type"] == "move"]


@pytest.mark.parametrize(
    "text",
    [CHARGES, CHARGES_BESIDE, CALLED_AWAY, COMES_LATER, HELD],
    ids=["charges", "beside", "called away", "comes later", "held"],
)
def test_the_rest_moves_as_the_whole_run(text: str) -> None:
    scenario = loaded(text)
    whole = play(scenario)
    expected = moves(whole.records)
    for end in range(2, len(whole.records) - 1):
        run = continued(whole, end, scenario)
        before, had = moves(whole.records[:end]), run.records[0]["scenario"]["begun"]["had"]
        after = [m for m in run.all("move") if m["tick"] > 1 or m["robot"] not in had]
        assert before + moves(after) == expected, (end, json.dumps(whole.records[end]))


def test_a_rest_begins_between_two_goals_of_a_turn() -> None:
    """Where it has gone for its charge, the robot also meets its own target."""
    scenario = loaded(CHARGES_ON_THE_WAY)
    whole = play(scenario)
    kinds = [line["type"] for line in whole.records]
    found = [n for n in range(len(kinds)) if kinds[n - 2 : n + 1] == ["goal", "synthesis", "goal"]]
    for end in found:
        continued(whole, end, scenario)
    assert found
