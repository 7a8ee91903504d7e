"""Robots out of service and new objectives; any changes at all: ``studio/test_editing.py``."""

import re
from typing import Any

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from runtime.played import begin, end, play
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
from safenav.scenario.model import Need, ObstacleType
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
        (None, "None is not an intervention"),
        (Intervention(), "Intervention() is not an intervention"),
        (SetService("digit", "out"), "'active' of SetService is 'out', not bool"),  # type: ignore[arg-type]
        (SetInput("alarm", "off"), "'on' of SetInput is 'off', not bool"),  # type: ignore[arg-type]
        (MarkResolved(47), "'obstacle' of MarkResolved is 47, not str"),  # type: ignore[arg-type]
        (PlaceOrder("crate", 20), "'type' of PlaceOrder is 'crate', not ObstacleType"),  # type: ignore[arg-type]
        (
            PlaceOrder(built_in().obstacles["crate"], True),
            "'region' of PlaceOrder is True, not int",
        ),
        (PutBack("digit", Pose(58, "north")), "'heading' of Pose is 'north', not"),  # type: ignore[arg-type]
    ],
    ids=str,
)
def test_an_intervention_with_parts_of_wrong_types_is_refused(wanted: Any, says: str) -> None:
    """``SetService("digit", "out")`` put it in service: a text is true."""
    mission = Mission(load_scenario(SCENARIOS / "case_study_1.yaml"))
    with pytest.raises(UsageError, match=re.escape(says)):
        mission.intervene(wanted)


ONE_DIGIT = (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0]
TWO_DIGITS = ONE_DIGIT.replace(
    "obstacles:",
    "  spare: {model: digit, start: 72, heading: east, avoids: [], objective: {patrol: [72, 69]}}\n"
    "obstacles:",
).replace(
    "heading: east, objective: {patrol: [58", "heading: east, avoids: [], objective: {patrol: [58"
)
ON_A_TARGET = """
safenav: 1
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  c: {model: go2, start: [1, 1], objective: {visit: [[1, 1], [1, 4]]}}
  d: {model: go2, start: [1, 4], objective: {hold: [1, 5]}}
until: {rounds: 1}
"""
ON_IT = (
    "d (by a change of the scenario; at 11 [1, 4], a target of c) out of service; "
    "not completed after 1 tick: c and d have"
)


def changes(told: str) -> str:
    """``12 digit out; 14 quad {hold: 8}``: what changes in which tick."""
    found = []
    for tick, robot, what in (one.split(" ", 2) for one in told.split("; ")):
        key = "service" if what in ("out", "back") else "objective"
        found.append(f"{{at: {tick}, robot: {robot}, {key}: {what}}}")
    return f"\nchanges: [{', '.join(found)}]\n"


@pytest.mark.parametrize(
    ("text", "told", "says", "helpers"),
    [
        (ONE_DIGIT, "12 digit out", "digit (by a change of the scenario) out of service", 1),
        (ONE_DIGIT, "3 digit out", "out of service", 0),
        (TWO_DIGITS, "13 spare out", "spare has completed", 2),
        (TWO_DIGITS, "13 spare out; 40 spare back", "", 2),
        (ONE_DIGIT, "2 digit out; 8 digit back; 20 quad {visit: [14, 16]}", "", 1),
        (ONE_DIGIT, "4 digit {visit: [58, 28]}", "", 1),
        (ONE_DIGIT, "7 digit out; 8 digit {visit: [70]}; 9 digit back", "", 1),
        (ON_A_TARGET, "1 d out", ON_IT, 0),
    ],
    ids=["helper", "nobody", "replaced", "back", "both", "same", "less", "on a target"],
)
def test_a_robot_out_of_service_is_replaced_or_an_operator_is_needed(
    text: str, told: str, says: str, helpers: int
) -> None:
    run = play(text.replace("{ticks: 500}", "{ticks: 120}") + changes(told))
    assert run.outcome["outcome"] == ("operator_needed" if says else "completed")
    assert says in run.outcome["explanation"]
    asked = {name for line in run.all("request") for name in line["helpers"][:1]}
    assert len(asked) == helpers


def test_an_obstacle_that_reappears_has_the_truth_of_its_entry() -> None:
    """Two of one name, the second of which turns out otherwise."""
    first, second = "{type: uncertainty, region: 43", "{type: uncertainty, region: 43, from: 15"
    entries = f"[{first}, until: 15, traversable: true}}, {second}, traversable: false}}]"
    text = (SCENARIOS / "case_study_3.yaml").read_text().split("obstacles:")[0]
    found = [r["traversable"] for r in play(f"{text}obstacles: {entries}\n").all("resolved")]
    assert found == [True, False]


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


@pytest.mark.parametrize("clock", ["", "clock: live\n"])
@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        (SetService("nobody", active=False), "no robot nobody"),
        (PutBack("nobody", Pose(20)), "no robot nobody|only in live runs"),
        (PutBack("cart", Pose(999)), "off the map|only in live runs|executes a command"),
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
        (
            AddObstacle(replace(DOOR, name="lid", listed=(Need("push", robots=0),)), 20),
            "the type lid has a wrong part",
        ),
        (PlaceOrder(CRATE, 999), "region 999 is off the map|stops robots"),
        (PlaceOrder(replace(CRATE, name="x", has_truth=True), 20), "has a truth"),
        (RemoveObstacle("nope@3"), "no unresolved obstacle nope@3"),
        (SetInput("alrm", on=True), "there is no input 'alrm'"),
        (MarkResolved("nope@3"), "the team knows no obstacle"),
        (MarkPermanent("nope@3"), "the team knows no obstacle|only in live runs"),
        (_visits(), "visit has 0 targets"),
        (_visits(999, 19), "expected free regions of the map"),
        (_visits(20, 19, avoid=frozenset({999})), "expected regions of the map"),
        (_visits(20, 19, always=("region' !=",)), "wrong formula"),
        (AssignObjective("cart", Visit([[19], [20]])), "a list in place of a frozenset"),  # type: ignore[arg-type,list-item]
        (AssignObjective("cart", Visit((frozenset({"a"}),))), "a wrong part"),  # type: ignore[arg-type]
        (AssignObjective("cart", Ltl()), "no formulas"),
        (AssignObjective("cart", Ltl(liveness=("fire",), inputs=("fire",))), "no input 'fire'"),
    ],
    ids=str,
)
def test_an_impossible_intervention_is_refused_at_the_call(
    wanted: Any, says: str, clock: str
) -> None:
    """The run continues as if it had not been requested."""
    mission, trace = begin(HALL + clock)
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
