"""Rounds of robots that stay at their last targets: each tick there counts once."""

import json
from collections.abc import Callable
from copy import deepcopy

import pytest

from runtime.facts import case
from runtime.played import play
from safenav import check_trace
from safenav.judge.formulas import Pose
from safenav.judge.proofs.joint import Goals, _met

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


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("in_order", [False, True])
def test_all_rounds_met_in_one_region_are_counted_together(in_order: bool, ends: bool) -> None:
    """A run of a trillion rounds is judged as fast as one of three."""
    pose: Pose = (7, None)
    own = Goals([frozenset({pose})] * 2, in_order, False, in_order and ends, [], False)
    few = [_met(own, pose, (rounds, 0)) for rounds in (1, 2, 3)]
    expected = [(0, 1), (0, 1), (0, 1)] if ends else [(0, 1), (0, 0), (0, 1)]
    assert few == (expected if in_order else [(0, 0)] * 3)
    assert _met(own, pose, (10**12, 0))[0] == 0
