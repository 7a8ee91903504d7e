"""Actions of robots of a fleet: the services called, and the meaning of their answers."""

import pytest

from once import beside
from safenav.fleet.file import FleetFile, Network, SimulationUse, Station, TransportKind
from safenav.fleet.robots import FleetProgress, TeamAction, unserved
from safenav.scenario.model import Need, Obstacle, ObstacleType, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.vocabulary import ActResult

DONE, FAILED, NOTHING = ActResult.DONE, ActResult.FAILED, ActResult.NOTHING
YARD = beside(__file__, "scenarios/crate_and_gate.yaml")


def yard() -> tuple[Scenario, Obstacle, Obstacle, dict[str, Station]]:
    scenario = load_scenario_text(YARD, "yard.yaml")
    crate, gate = scenario.obstacles
    stations = {name: Station(f"/{name}", act={"lift": "grip"}) for name in ("one", "two")}
    stations["fetch"] = Station("/fetch", act={"unlock": "key"})
    return scenario, crate, gate, stations


BESIDE = {"one": 9, "two": 11, "fetch": 8}


@pytest.mark.parametrize(
    ("answers", "result"),
    [((DONE, DONE), DONE), ((DONE, FAILED), FAILED), ((NOTHING, DONE), NOTHING)],
)
def test_every_lifter_is_called_and_the_worst_result_counts(
    answers: tuple[ActResult, ActResult], result: ActResult
) -> None:
    scenario, crate, _, stations = yard()
    team_action = TeamAction(scenario.robots[0], (crate,), FleetProgress(scenario))
    assert team_action.next(BESIDE, stations) == {"one": "grip", "two": "grip"}
    assert not team_action.answer("one", answers[0], BESIDE) and team_action.silent == ["two"]
    assert not team_action.answer("one", FAILED, BESIDE)  # it has answered
    assert team_action.answer("two", answers[1], BESIDE, "its arm jams")
    assert team_action.reasons == (["two: its arm jams"] if result is FAILED else [])
    assert team_action.resolved == (None if result is FAILED else crate)
    assert team_action.next(BESIDE, stations) == {} and team_action.found == [(crate, result)]


def test_an_obstacle_stays_until_its_last_need_is_fulfilled() -> None:
    """The gate is unlocked, and stays closed until a robot pushes it; what happens to other work
    changes nothing about that."""
    scenario, crate, gate, stations = yard()
    beside, progress = {**BESIDE, "fetch": 11}, FleetProgress(scenario)
    team_action = TeamAction(scenario.robots[2], (gate,), progress)
    assert team_action.next(beside, stations) == {"fetch": "key"}
    assert team_action.answer("fetch", DONE, beside) and team_action.resolved is None
    assert team_action.next(beside, stations) == {} and team_action.found == []
    progress.forget(crate)
    assert progress.need(gate) == 1


@pytest.mark.parametrize("answer", [DONE, NOTHING, FAILED])
def test_the_second_robot_at_a_load_does_not_fulfil_the_next_need(answer: ActResult) -> None:
    """Both reach for one parcel; the one that has it is still to bring it."""
    scenario = load_scenario_text(YARD, "yard.yaml")
    parcel = ObstacleType(
        "parcel",
        "lift",
        listed=(Need("lift"), Need("lift", at=frozenset({8}), same=True)),
        blocks=frozenset(),
    )
    order, progress = Obstacle(parcel, 9, ordered=True), FleetProgress(scenario)
    stations = {name: Station(f"/{name}", act={"lift": "grip"}) for name in ("one", "two")}
    there = {"one": 9, "two": 9}
    first, second = (TeamAction(robot, (order,), progress) for robot in scenario.robots[:2])
    assert first.next(there, stations) and second.next(there, stations)
    assert first.answer("one", DONE, there) and first.next(there, stations) == {}
    assert second.answer("two", answer, there) and second.next(there, stations) == {}
    assert second.found == [] and second.resolved is None
    assert progress.need(order) == 1
    at_goal = {"one": 8, "two": 8}  # only the one that carries it puts it down
    brings = [progress.group(order, robot, at_goal) for robot in scenario.robots[:2]]
    assert brings == [("one",), ()]


@pytest.mark.parametrize(
    ("acts", "told"),
    [
        ({"fetch": {"unlock": "key"}, "one": {"lift": "grip"}, "two": {"lift": "grip"}}, []),
        (
            {"fetch": {}, "one": {"lift": "grip"}, "two": {"lfit": "grip"}},
            [
                "two has no service for 'lift', which a crate needs",
                "fetch has no service for 'unlock', which a gate needs",
                "a service for 'lfit', which no robot can perform",
            ],
        ),
    ],
    ids=["all", "some"],
)
def test_actions_without_services_are_named(
    acts: dict[str, dict[str, str]], told: list[str]
) -> None:
    scenario, *_ = yard()
    stations = {name: Station(f"/{name}", act=act) for name, act in acts.items()}
    fleet = FleetFile(TransportKind.ROS2, Network(), SimulationUse(), stations)
    found = list(unserved(scenario, fleet))
    assert len(found) == len(told) and all(map(str.__contains__, found, told)), found
