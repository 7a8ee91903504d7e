"""Interventions of a program, any at all, and which are refused; others are ``cases/operator`` and
``cases/service``."""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from runtime.played import begin, end
from safenav import Mission, built_in, load_scenario
from safenav.errors import UsageError
from safenav.runtime.interventions import (
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
    SetTruth,
    read_intervention,
)
from safenav.runtime.worlds.simulation import SimulatedWorld
from safenav.scenario.model import ObstacleType
from safenav.scenario.objective import Hold, Ltl, Visit
from safenav.world.poses import Pose


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


GAP = HALL.replace("region: [3, 2]", "region: [2, 4]").replace("turtlebot4", "scout") + (
    "catalogue: {robots: {scout: {mobility: free, layer: ground, capabilities: [sense]}}}\n"
    "until: {rounds: 2}\n"
)
SHUT = GAP.replace("type: door", "type: uncertainty, traversable: false")
OPEN, FOG = SHUT.replace("false", "true"), built_in().obstacles["uncertainty"]


@pytest.mark.parametrize(
    ("text", "tick", "change", "ends"),
    [
        (GAP, 1, RemoveObstacle("door@22"), "completed"),
        (SHUT, 1, SetTruth("uncertainty@22", True), "completed"),
        (OPEN, 1, SetTruth("uncertainty@22", False), "operator_needed"),
        # It comes again, and is another one.
        (OPEN, 4, AddObstacle(FOG, 22, False), "operator_needed"),
        (GAP.replace("[2, 4]", "[3, 2]"), 1, AddObstacle(DOOR, 22), "operator_needed"),
    ],
    ids=["removed", "now traversable", "no longer", "another", "closed"],
)
def test_a_simulated_world_is_changed(text: str, tick: int, change: Any, ends: str) -> None:
    mission, run = begin(text)
    while mission.tick < tick:
        mission.step()
    mission.intervene(change)
    end(mission, run)
    assert run.outcome["outcome"] == ends, run.outcome["explanation"]


def test_no_region_is_closed_twice() -> None:
    mission, run = begin(SHUT.replace("[[2, 7], [2, 1]]", "[[2, 3], [2, 1]]"))
    mission.intervene(AddObstacle(DOOR, 29))
    with pytest.raises(UsageError, match="will be closed at the next tick"):
        mission.intervene(AddObstacle(FOG, 29, True))
    while not run.all("resolved"):
        mission.step()
    with pytest.raises(UsageError, match="uncertainty@22 is permanent"):
        mission.intervene(AddObstacle(DOOR, 22))


FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 50 or 3


def whatever(mission: Mission, world: SimulatedWorld, chance: Random) -> Intervention:
    """A change of a running world, possible or not."""
    kind = chance.choice(list(built_in().obstacles.values()))
    one, other = (frozenset({r}) for r in chance.sample(sorted(mission.scenario.map.free), 2))
    there = [obstacle.name for obstacle in world.standing().values()] or ["door@1"]
    robot = chance.choice(mission.scenario.robots).name
    truth = chance.random() < 0.5
    (region,) = one
    new = AddObstacle(kind, region, truth if kind.has_truth else None)
    objective = chance.choice([Hold((one,)), Visit((one | other,)), Visit((one, other))])
    return chance.choice(
        [
            RemoveObstacle(chance.choice(there)),
            SetTruth(chance.choice(there), truth),
            *(new, new),
            AssignObjective(robot, objective),
            SetService(robot, chance.random() < 0.6),
        ]
    )


@pytest.mark.parametrize("seed", range(FIRST, FIRST + SEQUENCES))
@pytest.mark.parametrize("name", ["case_study_1", "case_study_3", "two_digits"])
def test_a_run_that_is_changed_at_random_is_sound(
    name: str, seed: int, played: Callable[[], None]
) -> None:
    chance = Random(f"{name}/{seed}")
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    world = SimulatedWorld(scenario)
    mission, run = begin(scenario, world=world)
    while mission.result is None and mission.tick < 60:
        for _ in range(chance.choice((0, 0, 0, 0, 1, 2))):
            with suppress(UsageError):
                mission.intervene(whatever(mission, world, chance))
                played()
        mission.step()
    mission.give_up()
    assert not run.findings, run.findings
