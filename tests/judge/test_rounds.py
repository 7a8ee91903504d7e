"""Rounds of robots that stay at their last targets: each tick there counts once."""

import json
from collections.abc import Callable
from copy import deepcopy

import pytest

from runtime.facts import case
from runtime.played import play
from safenav import check_trace

PASSING = """
map: {grid: ["######", "#....#", "######"]}
inputs: {alarm: {at: [2-3]}}
robots:
  r: {model: quadcopter, start: 7, objective: OBJECTIVE, when: {alarm: {visit: [7, 8]}}}
until: {rounds: 3}
"""
SCENARIOS: dict[str, Callable[[], str]] = {
    "stops to charge": lambda: case("energy/rounds_at_the_last_target"),
    "hold after an input": lambda: PASSING.replace("OBJECTIVE", "{hold: 8}"),
    "once after an input": lambda: PASSING.replace("OBJECTIVE", "{once: [7, 8]}"),
    "hold at the start": lambda: PASSING.replace("OBJECTIVE", "{hold: 7}"),
}


@pytest.mark.parametrize("name", SCENARIOS)
def test_no_run_is_completed_one_tick_too_early(name: str) -> None:
    lines = play(SCENARIOS[name]()).records
    assert lines[-1]["outcome"] == "completed"
    assert check_trace(map(json.dumps, lines)).ok
    more = deepcopy(lines)
    more[0]["scenario"]["until"]["rounds"] = lines[-1]["rounds"]["r"] + 1
    more[-1]["rounds"]["r"] += 1
    assert {each.rule for each in check_trace(map(json.dumps, more)).findings} == {"end"}
