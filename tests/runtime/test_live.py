"""Live runs: commands and events, delays, failures and their consequences."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from runtime.played import Run, completed, loaded, play
from runtime.worlds import Clocked
from safenav import Mission
from safenav.batch.case import Ledger, differences
from safenav.runtime.control.answers import Answers
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.protocol import (
    Acted,
    Arrived,
    Elsewhere,
    Failed,
    Lost,
    Sensed,
    WorldEvent,
)
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock, FailedMoves, Failures
from safenav.team.floor import Floor
from safenav.world.map import Heading
from safenav.world.moves import Pose

RING = """
name: ring
map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: [push]}}}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}
  b: {model: cart, start: [3, 5], objective: {visit: [[3, 1], [3, 5]]}}
obstacles: [{type: door, region: [3, 3]}]
until: {rounds: 1}
clock: live
"""

Change = Callable[["Faulty", WorldEvent], Sequence[WorldEvent]]


class Faulty(LiveSimulation):
    """A simulation whose events are changed before the mission receives them."""

    def __init__(self, scenario: Scenario, change: Change) -> None:
        super().__init__(scenario)
        self.scenario, self.change = scenario, change
        self.count: dict[str, int] = {}
        self.last: dict[str, Pose] = {robot.name: robot.start for robot in scenario.robots}

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        self.last[robot.name] = self._poses[robot.name]
        super().start(robot, pose, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        return [told for event in super().wait(timeout) for told in self._told(event)]

    def _told(self, event: WorldEvent) -> Sequence[WorldEvent]:
        if isinstance(event, Arrived):
            self.count[event.robot] = self.count.get(event.robot, 0) + 1
        return self.change(self, event)

    def back(self, event: Arrived) -> Pose:
        """The robot is where it set out after all."""
        pose = self._poses[event.robot] = self.last[event.robot]
        (robot,) = (each for each in self.scenario.robots if each.name == event.robot)
        self.truth.move(robot, pose)
        return pose


def nth(number: int | None, fault: Callable[[Faulty, Arrived], Sequence[WorldEvent]]) -> Change:
    """The fault in place of the arrival of ``a`` with this number; None: of each."""

    def change(world: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
        if isinstance(event, Arrived) and event.robot == "a" and number in (None, world.count["a"]):
            return fault(world, event)
        return [event]

    return change


def fails(world: Faulty, event: Arrived, *, fatal: bool = False) -> Sequence[WorldEvent]:
    return [Failed(event.at, "a", world.back(event), "slips", fatal, command=event.command)]


def play_faulty(change: Change, text: str = RING, **options: Any) -> Run:
    """Play a run with changed events; its trace may pass the audit or not."""
    scenario, run = replace(loaded(text), **options), Run()
    Mission(scenario, world=Faulty(scenario, change), listeners=[run]).run()
    return run


SHIPPED = [
    *("case_study_2", "beam", "corridor_swap", "hospital", "team_of_six"),
    *("night_round", "parked_robot", "search_and_rescue", "warehouse_orders"),
]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_complete_in_time(name: str) -> None:
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    run, ledger = Run(), Ledger()
    result = Mission(scenario, listeners=[run, ledger]).run()
    assert result.outcome == "completed", result.explanation
    assert differences(scenario.expect, ledger) == []
    assert not run.findings
    times = [line["t"] for line in run.records[1:]]
    assert run.records[0]["clock"] == "live" and times == sorted(times)
    assert not run.all("move") and result.makespan == pytest.approx(times[-1])
    under_way, together = set(), 0
    for line in run.records:
        if line["type"] in ("depart", "arrive"):
            (under_way.add if line["type"] == "depart" else under_way.discard)(line["robot"])
            together = max(together, len(under_way))
    assert together >= 2


@pytest.mark.parametrize("seed", range(6))
def test_beliefs_hold_for_any_durations(seed: int) -> None:
    """Robots at half to double speed, every fifth step five times as long."""
    name = f"case_study_{1 + seed % 3}_beliefs"
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    draw = Random(seed)
    speeds = {robot.name: draw.uniform(0.5, 2) for robot in scenario.robots}
    world = LiveSimulation(scenario, speeds=speeds, delayed=0.2, seed=seed)
    run = completed(scenario, world=world)
    assert not run.all("assumption")
    assert run.all("belief", seen=True) and run.all("belief", seen=False)


def test_an_exhausted_search_names_the_robot_out_of_service(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only an operator brings the robot back, whatever plan another search would find."""
    plan = Answers.plan

    def spent(answers: Answers, floor: Floor, *about: Any) -> Any:
        return plan(answers, floor, *about) if 0 in floor.robots else None

    monkeypatch.setattr(Answers, "plan", spent)
    outcome = play_faulty(nth(1, partial(fails, fatal=True))).outcome
    assert (outcome["outcome"], outcome["cause"]) == ("operator_needed", "out_of_service")
    assert outcome["explanation"].startswith("a (its steps fail) out of service; search budget")


@pytest.mark.parametrize("rounds", [1, 3])
@pytest.mark.parametrize(
    "objective",
    [
        "{visit: [[1, 1], [1, 1]]}",
        "{visit: [[1, 1]]}",
        "{cover: [{any: [[1, 1], [1, 2]]}, [1, 1]]}",
        '{ltl: {liveness: ["region = 8"]}}',
    ],
)
def test_goals_that_are_met_where_a_robot_stands_take_no_time(rounds: int, objective: str) -> None:
    """Its strategy changes between two nodes there forever; the others continue. The trace
    does not grow with the passes: once it has its rounds, nothing more is counted there."""
    text = RING.replace("{visit: [[1, 5], [1, 1]]}", objective)
    text = text.replace("rounds: 1", f"rounds: {rounds}")
    run = play(text)
    outcome, goals = run.outcome, run.all("goal", robot="a")
    assert outcome["outcome"] == "completed" and outcome["rounds"] == {"a": rounds, "b": rounds}
    assert run.all("goal", robot="a", t=0.0) and not run.all("depart", robot="a")
    resolved = len(run.all("resolved"))  # then rounds restart
    targets = 2 if "], " in objective else 1
    assert len(goals) <= targets * (rounds + 1) * (1 + resolved) < outcome["ticks"]
    outcome["rounds"]["a"] += 1
    assert "end" in run.broken


def test_a_simulated_run_does_not_depend_on_the_hashes_of_a_process(tmp_path: Path) -> None:
    """Robots are examined in the scenario's order, so the same one is named in each process."""
    run = "import sys; from safenav.cli import main; sys.argv[0] = 'safenav'; main()"
    scenario = SCENARIOS / "night_round.yaml"
    told = []
    for seed in "01":
        trace = tmp_path / f"{seed}.jsonl"
        words = ["run", str(scenario), "--clock", "live", "--trace", str(trace)]
        subprocess.run(
            [sys.executable, "-c", run, *words],
            env={**os.environ, "PYTHONHASHSEED": seed},
            stdout=subprocess.DEVNULL,
            check=True,
        )
        lines = map(json.loads, trace.read_text().splitlines())
        told.append([(line["reason"], line["robots"]) for line in lines if line["type"] == "plan"])
    assert told[0] == told[1]
    assert told[0]


TURNED = """
map: {grid: ["######", "#....#", "#....#", "#....#", "######"]}
robots:
  a: {model: digit, start: [1, 2], heading: east, objective: {visit: [[1, 3], [3, 2]]}}
until: {rounds: 1}
clock: live
"""


def carried(region: int) -> Callable[[Scenario], Faulty]:
    """A world in which the first step of ``a`` ends in a region, facing south."""

    def fault(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
        world._poses["a"] = pose = Pose(region, Heading.SOUTH)
        return [Elsewhere(event.at, "a", pose, command=event.command)]

    return lambda scenario: Faulty(scenario, nth(1, fault))


def test_a_target_counts_if_a_robot_reaches_it_with_another_heading() -> None:
    """Its new strategy begins there with that met; it went to it again before that counted."""
    run = completed(TURNED, world=carried(9))
    assert [goal["tick"] for goal in run.all("goal")] == [run.one("arrive", at=9)["tick"], 12]


def test_a_region_that_fails_repeatedly_is_an_obstacle() -> None:
    """The robot goes round the other way."""

    def there(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
        stuck = world._poses["a"].region == 10
        return fails(world, event) if stuck else [event]

    run = play_faulty(nth(None, there))
    assert run.outcome["outcome"] == "completed", run.outcome
    assert len(run.all("arrive", result="failed")) == 3
    assert run.one("violation", obstacle="unknown_ground@10")["action"] == "operator"
    assert run.all("blocked", obstacle="unknown_ground@10", reason="no_capable_robot")
    assert run.one("request")["because"] == "it needs an operator"


@pytest.mark.parametrize(
    ("change", "failures"),
    [
        (nth(2, lambda w, e: fails(w, e, fatal=True)), Failures()),
        (nth(None, fails), Failures(retries=9, most=4)),
        (nth(None, fails), Failures(then=FailedMoves.OUT_OF_SERVICE)),
        (nth(2, lambda _, e: [replace(e, command=None), Elsewhere(e.at, "a", Pose(0),
                                                                  command=e.command)]), Failures()),
    ],
    ids=["fatal", "most", "then", "impossible"],
)  # fmt: skip
def test_a_robot_that_fails_permanently_is_out_of_service(
    change: Change, failures: Failures
) -> None:
    run = play_faulty(change, failures=failures)
    assert run.all("service", robot="a", active=False, cause="world")
    assert (run.outcome["outcome"], run.outcome["cause"]) == ("operator_needed", "out_of_service")
    assert re.match(r"a \(.+\) out of service;", run.outcome["explanation"])


def gone(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
    regions = frozenset({world.last["a"].region, world._poses["a"].region})
    return [Lost(event.at, "a", regions, command=event.command)]


@pytest.mark.parametrize(
    ("extra", "closed"),
    [("never_together: [{robots: [a, b, q], in: [[2, 1], [2, 5]]}]\n", True), ("", False)],
    ids=["never together elsewhere", "in conflict with the lost robot"],
)
def test_no_robot_enters_a_region_where_another_may_be_lost_below_a_drone(
    extra: str, closed: bool
) -> None:
    """It is closed also while another one that conflicts with the lost robot is there."""

    def lost(_: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
        if isinstance(event, Arrived) and event.robot == "a":
            return [Lost(event.at, "a", frozenset({8, 11}), command=event.command)]
        return [event]

    avoids = "" if closed else ", avoids: [a]"
    q = f"  q: {{model: quadcopter, start: [1, 4], objective: {{hold: [1, 4]}}{avoids}}}\n"
    text = RING.replace("obstacles:", f"{q}obstacles:")
    run = play_faulty(lost, text.replace("[[3, 1], [3, 5]]", "[[1, 3], [3, 5]]") + extra)
    assert run.one("arrive", result="lost")["regions"] == [8, 11]
    names = {line["obstacle"]["name"] for line in run.all("discovered")}
    assert "lost_a@11" in names
    assert not run.all("depart", robot="b", to=11)
    assert not closed or not {"collision"} & {*run.broken}


def test_a_robot_that_may_be_in_a_zone_closes_it_to_those_never_together_with_it() -> None:
    """All of it, though it may be in one of its regions only; others may be beside it."""
    c = "  c: {model: cart, start: [2, 1], objective: {hold: [2, 1]}}\n"
    zone = "never_together: [{robots: [a, b], in: [[1, 2], [1, 3], [1, 4]]}]\n"
    text = RING.replace("[[3, 1], [3, 5]]", "[[1, 4], [3, 5]]")
    text = text.replace("obstacles:", f"{c}obstacles:")
    run = play_faulty(nth(1, gone), text + zone)
    lost = run.one("arrive", result="lost")
    assert (lost["at"], lost["regions"]) == (8, [8, 9])
    closed = {each["obstacle"]["region"]: each["obstacle"] for each in run.all("discovered")}
    assert {region: each["blocks"] for region, each in closed.items() if region < 14} == {
        9: ["a", "b", "c"],
        10: ["a", "b"],
        11: ["a", "b"],
    }
    assert not [line for line in run.all("depart", robot="b") if line["to"] in (9, 10, 11)]
    assert run.outcome["outcome"] == "operator_needed"
    assert not {"violation", "backtrack", "request", "never-together"} & {*run.broken}


def test_a_sensor_of_the_building_closes_a_region() -> None:
    """No robot senses the door by itself, and none can open it; it stops no robot."""

    def seen(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
        return [event, Sensed(event.at, world.scenario.obstacles[0])]

    scenario, run = loaded(RING.replace("[push]", "[]")), Run()
    world = Faulty(scenario, nth(1, seen))
    world.sense = lambda *_: None  # type: ignore[method-assign]
    Mission(scenario, world=world, listeners=[run]).run()
    assert run.outcome["outcome"] == "completed" and not run.findings
    assert run.all("violation") and not run.all("arrive", result="blocked")


def test_reports_that_are_late_or_doubled_are_dropped() -> None:
    def twice(_: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
        if isinstance(event, Acted):
            door = event.found[0][0]
            return [event, event, Sensed(event.at - 1, door, there=False), "nonsense"]  # type: ignore[list-item]
        return [event, event] if isinstance(event, Arrived) else [event]

    run = play_faulty(twice)
    assert run.outcome["outcome"] == "completed", run.outcome
    late = run.all("late")
    assert {line["event"] for line in late} >= {"arrived", "acted", "worldevent"}
    assert len(late) >= len(run.all("arrive"))


@pytest.mark.parametrize(
    ("model", "policy", "seconds"),
    [
        ("", Failures(timeout=30.0), 60),
        (", size: 0.5, speed: 1.0, motion: rover", Failures(), 120),
        (", size: 0.5, speed: 0.1, motion: rover", Failures(patience=2.0), 202.5),
    ],
    ids=["its time is over", "a first step, at least a minute", "a first step of a slow model"],
)
def test_a_command_that_does_not_end_is_cancelled_and_its_robot_lost(
    model: str, policy: Failures, seconds: float
) -> None:
    class Silent(Faulty):
        cancelled = 0

        def cancel(self, robot: Robot) -> None:
            self.cancelled += robot.name == "a"

    ring = loaded(RING.replace("[push]", "[push]" + model))
    scenario = replace(ring, failures=policy, limits=replace(ring.limits, seconds=2000.0))
    world = Silent(scenario, nth(2, lambda *_: []))
    run = Run()
    Mission(scenario, world=world, listeners=[run]).run()
    lost = run.one("arrive", result="lost")
    depart = run.one("depart", command=lost["command"])
    assert world.cancelled == 1 and lost["t"] - depart["t"] == pytest.approx(seconds, abs=0.01)
    assert "after it was cancelled" in lost["reason"]


@pytest.mark.parametrize(
    ("event", "also"),
    [
        pytest.param(lambda at: Elsewhere(at, "a", Pose(0)), set(), id="a wall"),
        pytest.param(lambda at: Elsewhere(at, "a", Pose(12)), {12}, id="far away"),
        pytest.param(lambda at: Failed(at, "a", Pose(12), "no way"), {12}, id="failed far away"),
        pytest.param(lambda at: Lost(at, "a", frozenset({0, 12})), {12}, id="lost in a wall"),
        pytest.param(lambda at: Lost(at, "a", frozenset({999})), set(), id="off the map"),
        pytest.param(lambda at: Acted(at, "a", []), set(), id="no end of a step"),
    ],
)
def test_a_robot_that_reports_an_impossible_region_is_lost(
    event: Callable[[float], WorldEvent], also: set[int]
) -> None:
    """It may be at both ends of its step, or where it says; no other robot enters these."""
    run = play_faulty(nth(1, lambda _, e: [replace(event(e.at), command=e.command)]))
    lost = run.one("arrive", result="lost")
    depart = run.one("depart", command=lost["command"])
    assert {*lost["regions"]} == {depart["from"], depart["to"], *also} and lost["reason"]
    after = Run(run.records[run.records.index(lost) :])
    assert not [line for line in after.all("depart") if line["to"] in lost["regions"]]


class Distant(Clocked):
    """Robots with another driver: they do only as commanded."""

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        if not obstacles:
            return Acted(self.now(), robot.name, command=command)
        return self.simulation.act(robot, obstacles, command)


def test_robots_without_a_command_fulfil_no_need() -> None:
    """The robot passes by an obstacle that the scenario lists and no robot has found."""
    pile = "{needs: [{action: push, at: neighbours}, {action: lift, at: neighbours}]}"
    text = RING.replace("[push]}}}", f"[push]}}}}, obstacles: {{pile: {pile}}}}}")
    text = text.replace("type: door, region: [3, 3]", "type: pile, region: [1, 4]")
    text = text.replace("[[1, 5], [1, 1]]", "[[1, 3], [1, 1]]")
    run = completed(text, world=Distant)
    assert not run.all("met") and not run.all("act")
