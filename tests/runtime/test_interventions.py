"""Interventions of a program, and which are refused; others are ``cases/operator`` and
``cases/service``, any changes at all ``studio/test_editing.py``."""

import re
from typing import Any

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from runtime.played import begin, end
from safenav import Mission, built_in, load_scenario
from safenav.errors import UsageError
from safenav.runtime.intervention.kinds import (
    AddObstacle,
    AssignObjective,
    Intervention,
    MarkPermanent,
    MarkResolved,
    PlaceOrder,
    PutBack,
    RemoveObstacle,
    SetInput,
    SetService,
)
from safenav.runtime.intervention.reading import read_intervention
from safenav.scenario.model import ObstacleType
from safenav.scenario.objective import Ltl, Visit
from safenav.world.moves import Pose


def test_an_intervention_that_has_become_impossible_is_dropped_with_a_line() -> None:
    """In lockstep, too."""
    mission, trace = begin(load_scenario(SCENARIOS / "case_study_1.yaml"))
    while not trace.all("violation"):
        mission.step()
    name = trace.one("violation")["obstacle"]
    for _ in range(2):
        mission.intervene(MarkResolved(name))
    end(mission, trace)
    assert trace.one("late")["reason"].startswith(f"the team knows no obstacle '{name}'")
    assert trace.one("late").get("at") is None


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        ("resolved door@47", "'resolved door@47' is not an intervention: use safenav.MarkResolved"),
        (Intervention(), "Intervention() is not an intervention"),
        (SetService("digit", "out"), "SetService has a wrong part: `active` must be true or false"),  # type: ignore[arg-type]
        (PutBack("digit", Pose(58, "north")), "`pose.heading` must be"),  # type: ignore[arg-type]
        (AssignObjective("digit", Visit(())), "`objective` must be an objective such as"),
    ],
    ids=str,
)
def test_an_intervention_with_parts_of_wrong_types_is_refused(wanted: Any, says: str) -> None:
    """``SetService("digit", "out")`` put it in service: a text is true."""
    mission = Mission(load_scenario(SCENARIOS / "case_study_1.yaml"))
    with pytest.raises(UsageError, match=re.escape(says)):
        mission.intervene(wanted)


DOOR, CRATE = built_in().obstacles["door"], built_in().obstacles["crate"]
HALL = """
name: hall
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots:
  cart: {model: turtlebot4, start: [2, 1], objective: {visit: [[2, 7], [2, 1]]}}
obstacles: [{type: door, region: [3, 2]}]
inputs: {alarm: {at: [3]}}
"""


def _visits(*targets: int, **rules: Any) -> AssignObjective:
    each = tuple(frozenset({target}) for target in targets)
    return AssignObjective("cart", Visit(each, **rules))


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        (SetService("nobody", active=False), "no robot nobody"),
        (PutBack("nobody", Pose(20)), "no robot nobody"),
        (PutBack("cart", Pose(999)), "executes a command"),
        (AddObstacle(DOOR, 999), "region 999 is off the map"),
        (AddObstacle(DOOR, 20, truth=True), "a door has no truth"),
        (AddObstacle(replace(DOOR, action="sense"), 20), "the scenario has another type door"),
        (AddObstacle(replace(DOOR, name="a b"), 20), "'a b' cannot name an obstacle type"),
        (AddObstacle(replace(DOOR, name="lost_cart"), 20), "the name lost_cart is reserved"),
        (AddObstacle(ObstacleType("lid", "push", frozenset({0})), 20), "no region where lid"),
        (
            AddObstacle(replace(DOOR, name="lid", blocks=frozenset({"dgit"})), 20),
            "'blocks' of lid: 'dgit' is not",
        ),
        (PlaceOrder(CRATE, 999), "region 999 is off the map"),
        (PlaceOrder(CRATE, 20), "stops robots"),
        (PlaceOrder(replace(CRATE, name="x", has_truth=True), 20), "has a truth"),
        (RemoveObstacle("nope@3"), "no unresolved obstacle nope@3"),
        (SetInput("alrm", on=True), "there is no input 'alrm'"),
        (MarkResolved("nope@3"), "the team knows no obstacle"),
        (_visits(999, 19), "expected free regions of the map"),
        (_visits(20, 19, avoid=frozenset({999})), "expected regions of the map"),
        (_visits(20, 19, always=("region' !=",)), "wrong formula"),
        (_visits(20, 19, always=("regoin' != 3",)), "wrong formula: .*regoin"),
        (AssignObjective("cart", Ltl()), "no formulas"),
        (AssignObjective("cart", Ltl(liveness=("fire",), inputs=("fire",))), "no input 'fire'"),
    ],
    ids=str,
)
def test_an_impossible_intervention_is_refused_at_the_call(wanted: Any, says: str) -> None:
    """The run continues as if it had not been requested."""
    mission, trace = begin(HALL + "clock: live\n")
    mission.step()
    with pytest.raises(UsageError, match=says):
        mission.intervene(wanted)
    end(mission, trace)
    assert trace.outcome["outcome"] == "completed" and not trace.findings
    assert not trace.all("late")


@pytest.mark.parametrize("wanted", [PutBack("cart", Pose(20)), MarkPermanent("door@29")], ids=str)
def test_features_of_live_runs_are_refused_in_lockstep(wanted: Any) -> None:
    mission, _ = begin(HALL.replace("region: [3, 2]", "region: [2, 4]"))
    with pytest.raises(UsageError, match="only in live runs"):
        mission.intervene(wanted)


def test_a_robot_with_a_battery_refuses_an_objective_without_an_order_of_targets() -> None:
    """It would forget at each charge which targets it has met."""
    scenario = load_scenario(SCENARIOS / "battery_delivery.yaml")
    (robot, *_) = (each.name for each in scenario.robots if each.model.battery)
    with pytest.raises(UsageError, match="without an order of its targets"):
        read_intervention(f"objective {robot} {{cover: {[*scenario.map.free[:2]]}}}", scenario)
