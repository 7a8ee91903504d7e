"""Robots that charge while the team waits for an operator or a change of the scenario."""

import json

import pytest

from safenav import Mission
from safenav.audit.check import check_trace
from safenav.outcome import Outcome
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.writing import as_data

CUT_OFF = """
safenav: 1
map: {grid: ["#..", "..."]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, battery: {capacity: 13, charge: 1, stay: 1}}
robots:
  cart: {model: cart, start: 4, objective: {once: [2, 5]}}
obstacles: [{type: crate, region: 2}]
inputs: {alarm: {at: ["7-15"]}}
chargers: [5]
"""
HELPS = """
safenav: 1
map: {grid: ["...", "...", "..#"]}
catalogue:
  robots:
    lifter:
      {mobility: free, layer: ground, capabilities: [lift],
       battery: {capacity: 12, charge: 1, start: 7}}
    cart: {mobility: heading, layer: ground}
  obstacles: {pallet: {needs: [{action: lift}], blocks: []}}
robots:
  lifter: {model: lifter, start: 3, objective: {patrol: [6, 2]}}
  cart: {model: cart, start: 1, heading: north, objective: {patrol: [2, 3]}}
obstacles: [{type: crate, region: 5}]
orders: [{at: 1, type: pallet, region: 2}, {at: 6, type: pallet, region: 2}]
chargers: [1]
"""


@pytest.mark.parametrize(
    ("text", "clock", "charger"),
    [(CUT_OFF, "lockstep", 5), (HELPS, "live", 1)],
    ids=["a robot that waits for help", "a robot that was to help"],
)
def test_a_robot_goes_to_its_charger_while_the_team_waits(
    text: str, clock: str, charger: int
) -> None:
    """Standing still would use up its charge before the change for which the team waits."""
    lines: list[str] = []
    scenario = load_scenario_text(f"{text}clock: {clock}\n")
    heard = [lambda record: lines.append(json.dumps(as_data(record)))]
    result = Mission(scenario, listeners=heard).run()
    told = [json.loads(line) for line in lines]
    begins = next(n for n, line in enumerate(told) if line["type"] == "waiting")
    reached = [line.get("to", line.get("region")) for line in told[begins:]]
    assert charger in reached
    assert not any(line["type"] == "service" for line in told)
    assert result.outcome is Outcome.OPERATOR_NEEDED
    assert check_trace(lines).findings == ()
