"""Impossible interventions are refused with their reasons."""

import pytest

from safenav import Mission
from safenav.errors import InputError, UsageError
from safenav.runtime.intervention.reading import read_intervention
from safenav.scenario.reading.loader import load_scenario_text

CART = """
safenav: 1
map: {grid: ["....."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: []}}
  obstacles: {gate: {action: push}}
robots: {c: {model: cart, start: 0, objective: {visit: [4, 0]}}}
obstacles: [{type: gate, region: 2}]
until: {rounds: 1}
"""


def waiting(clock: str) -> Mission:
    """A mission that has met the gate, and waits for an operator if it is live."""
    scenario = load_scenario_text(f"{CART}clock: {clock}\n")
    mission = Mission(scenario, attended=clock == "live")
    mission.start()
    while not mission._run.state.requests and mission.waiting is None and mission.result is None:
        mission.step()
    return mission


@pytest.mark.parametrize(
    ("clock", "word", "said"),
    [
        ("live", "put_back c 2", "gate@2 is in region 2: resolve it first"),
        ("lockstep", "put_back c 1", "robots are put back only in live runs"),
        ("lockstep", "permanent gate@2", "obstacles become permanent only in live runs"),
    ],
)
def test_an_impossible_intervention_is_refused_with_its_reason(
    clock: str, word: str, said: str
) -> None:
    mission = waiting(clock)
    with pytest.raises(UsageError, match=said):
        mission.intervene(read_intervention(word, mission.scenario))


def test_a_robot_can_be_put_back_where_an_obstacle_was_resolved() -> None:
    mission = waiting("live")
    for word in ("resolved gate@2", "put_back c 2", "resolved gate@2"):
        mission.intervene(read_intervention(word, mission.scenario))
    mission.step()
    assert mission._run.state.robots[0].pose == 2
    while mission.result is None:
        mission.step()
    assert mission.result.outcome == "completed"


def test_a_robot_with_a_battery_refuses_an_objective_without_an_order_of_targets() -> None:
    """It would forget at each charge which targets it has met."""
    text = CART.replace("capabilities: []", "capabilities: [], battery: {capacity: 9, charge: 3}")
    text += "chargers: [0]\nchanges: [{at: 3, robot: c, objective: {cover: [1, 0]}}]\n"
    with pytest.raises(InputError, match="without an order of its targets"):
        load_scenario_text(text)
    mission = Mission(load_scenario_text(text.replace("cover", "visit")))
    with pytest.raises(UsageError, match="without an order of its targets"):
        read_intervention("objective c {cover: [1, 0]}", mission.scenario)
