"""Live runs: commands and events, delays, failures, and what follows them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from safenav import Mission
from safenav.audit.check import check_trace
from safenav.errors import UsageError
from safenav.outcome import Outcome
from safenav.report.terminal.story import Story
from safenav.runtime.actions import Actions
from safenav.runtime.analysis.expectation import Ledger, differences
from safenav.runtime.failures import Reaction, Troubles
from safenav.runtime.termination import Conclusion, RunEnded
from safenav.runtime.traffic.execution import schedule, still, with_steps_under_way
from safenav.runtime.traffic.joint import Joint
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.worlds.protocol import (
    Acted,
    Arrived,
    Blocked,
    Elsewhere,
    Failed,
    Lost,
    Sensed,
    WorldEvent,
)
from safenav.runtime.worlds.simulation import LiveSimulation
from safenav.runtime.worlds.world import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.scenario.settings import Clock, FailedMoves, Failures
from safenav.trace.vocabulary import ActResult
from safenav.trace.writing import TraceWriter, as_data
from safenav.world.moves import Pose

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RING = """
safenav: 1
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

DEBRIS = RING.replace("type: door", "type: debris").replace(
    "capabilities: [push]}}}",
    "capabilities: [clear]}}, obstacles: {debris: {action: clear, resolve_at: neighbours}}}",
)

Change = Callable[["Faulty", WorldEvent], Sequence[WorldEvent]]


class Faulty(LiveSimulation):
    """A simulation whose events somebody changes on their way to the mission."""

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
        self.truth._regions[event.robot] = pose.region
        return pose


def nth(number: int, fault: Callable[[Faulty, Arrived], Sequence[WorldEvent]]) -> Change:
    """The fault in place of the arrival of ``a`` with this number."""

    def change(world: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
        if isinstance(event, Arrived) and event.robot == "a" and world.count["a"] == number:
            return fault(world, event)
        return [event]

    return change


def always(fault: Callable[[Faulty, Arrived], Sequence[WorldEvent]]) -> Change:
    """The fault in place of each arrival of ``a``."""

    def change(world: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
        ours = isinstance(event, Arrived) and event.robot == "a"
        return fault(world, event) if ours else [event]  # type: ignore[arg-type]

    return change


def fails(world: Faulty, event: Arrived, *, fatal: bool = False) -> Sequence[WorldEvent]:
    return [Failed(event.at, "a", world.back(event), "slips", fatal, command=event.command)]


def played(
    tmp_path: Path, change: Change, text: str = RING, **options: Any
) -> tuple[Any, list[dict[str, Any]]]:
    scenario = replace(load_scenario_text(text), **options)
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        result = Mission(scenario, world=Faulty(scenario, change), listeners=[writer]).run()
    return result, [json.loads(line) for line in trace.read_text().splitlines()]


def of(lines: list[dict[str, Any]], kind: str, **fields: object) -> list[dict[str, Any]]:
    return [
        line
        for line in lines
        if line["type"] == kind and all(line.get(k) == v for k, v in fields.items())
    ]


SHIPPED = [
    *("case_study_2", "beam", "corridor_swap", "hospital", "team_of_six"),
    *("night_round", "parked_robot", "search_and_rescue", "warehouse_orders"),
]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_complete_in_time(name: str, tmp_path: Path) -> None:
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    trace, ledger = tmp_path / "trace.jsonl", Ledger()
    with TraceWriter(trace) as writer:
        result = Mission(scenario, listeners=[writer, ledger]).run()
    assert result.outcome == "completed", result.explanation
    assert differences(scenario.expect, ledger) == []
    assert check_trace(trace).findings == ()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    times = [line["t"] for line in lines[1:]]
    assert lines[0]["clock"] == "live" and times == sorted(times)
    assert not of(lines, "move") and result.makespan == pytest.approx(times[-1])
    under_way, together = set(), 0
    for line in lines:
        if line["type"] in ("depart", "arrive"):
            (under_way.add if line["type"] == "depart" else under_way.discard)(line["robot"])
            together = max(together, len(under_way))
    assert together >= 2


@pytest.mark.parametrize("seed", range(6))
def test_beliefs_hold_for_any_durations(seed: int, tmp_path: Path) -> None:
    """Robots at half to double speed, every fifth step five times as long."""
    name = f"case_study_{1 + seed % 3}_beliefs"
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    draw = Random(seed)
    speeds = {robot.name: draw.uniform(0.5, 2) for robot in scenario.robots}
    world = LiveSimulation(scenario, speeds=speeds, delayed=0.2, seed=seed)
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        result = Mission(scenario, world=world, listeners=[writer]).run()
    assert result.outcome == "completed", result.explanation
    assert check_trace(trace).findings == ()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    assert not of(lines, "assumption")
    assert of(lines, "belief", seen=True) and of(lines, "belief", seen=False)


def test_a_spent_search_says_who_is_out_of_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only an operator brings the robot back, whatever plan another search would find."""
    spent = Conclusion(Outcome.SEARCH_LIMIT, "budget spent")

    def tick(traffic: Traffic) -> bool:
        if not traffic.state.robots["a"].active:
            raise RunEnded(spent)
        return False

    monkeypatch.setattr(Traffic, "tick", tick)
    result, _ = played(tmp_path, nth(1, partial(fails, fatal=True)))
    assert (result.outcome, result.cause) == ("operator_needed", "out_of_service")
    assert result.explanation == "a out of service; budget spent"


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
def test_goals_that_are_met_where_a_robot_stands_take_no_time(
    rounds: int, objective: str, tmp_path: Path
) -> None:
    """Its strategy changes between two nodes there for ever; the others go on meanwhile. The trace
    does not grow with the passes: once it has its rounds, nothing more is counted there."""
    text = RING.replace("{visit: [[1, 5], [1, 1]]}", objective)
    text = text.replace("rounds: 1", f"rounds: {rounds}")
    result, lines = played(tmp_path, lambda _, event: [event], text)
    assert result.outcome == "completed" and result.rounds["b"] == rounds
    goals = of(lines, "goal", robot="a")
    assert of(goals, "goal", t=0.0) and not of(lines, "depart", robot="a")
    resolved = len(of(lines, "resolved"))  # then rounds restart
    targets = 2 if "], " in objective else 1
    assert result.rounds["a"] == rounds
    assert len(goals) <= targets * (rounds + 1) * (1 + resolved) < result.ticks
    path = tmp_path / "trace.jsonl"
    assert check_trace(path).findings == ()
    lines[-1]["rounds"]["a"] += 1
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert "rounds" in {finding.rule for finding in check_trace(path).findings}


def test_without_faults(tmp_path: Path) -> None:
    result, lines = played(tmp_path, lambda _, event: [event])
    assert result.outcome == "completed" and not of(lines, "late")
    assert {line["result"] for line in of(lines, "arrive")} == {"arrived"}


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


def test_a_failed_move_is_repeated(tmp_path: Path) -> None:
    result, lines = played(tmp_path, nth(2, fails))
    assert result.outcome == "completed"
    (failed,) = of(lines, "arrive", result="failed")
    again = next(d for d in of(lines, "depart", robot="a") if d["command"] > failed["command"])
    assert failed["reason"] == "slips" and again["from"] == failed["at"]


def test_a_region_that_fails_again_and_again_is_an_obstacle(tmp_path: Path) -> None:
    """The robot goes round the other way."""

    def there(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
        stuck = world._poses["a"].region == 10
        return fails(world, event) if stuck else [event]

    result, lines = played(tmp_path, always(there))
    assert result.outcome == "completed", result.explanation
    assert len(of(lines, "arrive", result="failed")) == 3
    (violation,) = of(lines, "violation", obstacle="unknown_ground@10")
    assert violation["action"] == "operator"
    assert of(lines, "blocked", obstacle="unknown_ground@10", reason="no_capable_robot")


@pytest.mark.parametrize(
    ("change", "failures"),
    [
        (nth(2, lambda w, e: fails(w, e, fatal=True)), Failures()),
        (always(fails), Failures(retries=9, most=4)),
        (always(fails), Failures(then=FailedMoves.OUT_OF_SERVICE)),
        (nth(2, lambda _, e: [replace(e, command=None), Elsewhere(e.at, "a", Pose(0),
                                                                  command=e.command)]), Failures()),
    ],
    ids=["fatal", "most", "then", "impossible"],
)  # fmt: skip
def test_a_robot_that_fails_for_good_is_out_of_service(
    change: Change, failures: Failures, tmp_path: Path
) -> None:
    result, lines = played(tmp_path, change, failures=failures)
    assert of(lines, "service", robot="a", active=False, cause="world")
    assert (result.outcome, result.cause) == ("operator_needed", "out_of_service")
    assert "a out of service" in result.explanation


def test_all_regions_of_a_lost_robot_are_closed(tmp_path: Path) -> None:
    def gone(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
        regions = frozenset({world.last["a"].region, world._poses["a"].region})
        return [Lost(event.at, "a", regions, command=event.command)]

    result, lines = played(tmp_path, nth(1, gone))
    (lost,) = of(lines, "arrive", result="lost")
    closed = {line["obstacle"]["name"] for line in of(lines, "discovered")}
    assert closed == {f"lost_a@{region}" for region in {*lost["regions"]} - {lost["at"]}}
    after = lines[lines.index(lost) :]
    assert not [line for line in of(after, "depart") if line["to"] in lost["regions"]]
    assert result.outcome in ("operator_needed", "completed")


def test_what_a_robot_meets_on_its_way_is_an_obstacle(tmp_path: Path) -> None:
    def meets(world: Faulty, event: Arrived) -> Sequence[WorldEvent]:
        door = Obstacle(built_in().obstacles["uncertainty"], world._poses["a"].region, True)
        return [Blocked(event.at, "a", world.back(event), door, command=event.command)]

    _, lines = played(tmp_path, nth(2, meets))
    (violation,) = of(lines, "violation", robot="a")
    assert violation["obstacle"].startswith("uncertainty@")
    assert of(lines, "blocked", obstacle=violation["obstacle"])


def test_reports_that_are_late_or_doubled_are_dropped(tmp_path: Path) -> None:
    def twice(_: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
        if isinstance(event, Acted):
            door = event.found[0][0]
            return [event, event, Sensed(event.at - 1, door, there=False), "nonsense"]  # type: ignore[list-item]
        return [event, event] if isinstance(event, Arrived) else [event]

    result, lines = played(tmp_path, twice)
    assert result.outcome == "completed", result.explanation
    late = of(lines, "late")
    assert {line["event"] for line in late} >= {"arrived", "acted", "worldevent"}
    assert len(late) >= len(of(lines, "arrive"))


def test_after_two_failed_actions_another_robot_helps(tmp_path: Path) -> None:
    class Jammed(LiveSimulation):
        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            if robot.name == "a":
                return super().act(robot, obstacles, command)
            found = tuple((obstacle, ActResult.FAILED) for obstacle in obstacles)
            return Acted(self.now(), "b", found, command=command)

    scenario = load_scenario_text(DEBRIS)
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        result = Mission(scenario, world=Jammed(scenario), listeners=[writer]).run()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    assert result.outcome == "completed", result.explanation
    assert len(of(lines, "acted", robot="b")) == 2
    (resolved,) = of(lines, "resolved")
    assert resolved["robot"] == "a"


STARTS = """
safenav: 1
name: starts where it can act
map: {grid: ["#########", "#.......#", "#.......#", "#########"]}
catalogue:
  robots: {lifter: {mobility: free, layer: ground, capabilities: [lift]}}
  obstacles: {crate: {needs: [{action: lift, at: neighbours}, {action: sense, at: neighbours}]}}
robots:
  lifter: {model: lifter, start: [1, 2], objective: {visit: [[2, 1], [1, 2]]}}
  seer: {model: quadcopter, start: [1, 4], objective: {visit: [[2, 7], [1, 4]]}}
obstacles: [%s]
until: {rounds: 1}
limits: {ticks: 60}
"""
SUSPECT = "{type: uncertainty, region: [1, 5], traversable: true}"
CRATE = "{type: crate, region: [1, 3]}"


class Calls:
    """A world of blocking calls: the simulation, which does not say before what a robot can do.
    It learns from the moves which robots there are."""

    def __init__(self, scenario: Scenario) -> None:
        self.there = set[str]()
        self.world = SimulatedWorld(scenario)
        self.sense = self.world.sense

    def move(self, robot: Robot, pose: Pose) -> None:
        self.there.add(robot.name)
        self.world.move(robot, pose)

    def act(self, robot: Robot) -> Any:
        assert robot.name in self.there
        return self.world.act(robot)


@pytest.mark.parametrize(
    ("obstacle", "clock", "world"),
    [
        (SUSPECT, Clock.LOCKSTEP, None),
        (SUSPECT, Clock.LOCKSTEP, Calls),
        (SUSPECT, Clock.LIVE, None),
        (CRATE, Clock.LOCKSTEP, None),  # its second need comes after the robot that meets it
    ],
)
def test_robots_act_where_they_start_before_they_leave(
    obstacle: str, clock: Clock, world: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On both clocks; in lockstep the tick is used up by that, and the audit asks for it."""
    scenario = replace(load_scenario_text(STARTS % obstacle), clock=clock)

    def run() -> list[dict[str, Any]]:
        told: list[dict[str, Any]] = []
        place = None if world is None else world(scenario)
        mission = Mission(scenario, world=place, listeners=[lambda r: told.append(as_data(r))])
        assert mission.run().outcome == "completed"
        return told

    told = run()
    assert check_trace(map(json.dumps, told)).findings == ()
    (resolved,) = of(told, "resolved")
    start = scenario.robots[1].start.region
    steps = [m for m in of(told, "move", robot="seer") if m["to"] != m["from"]]
    steps += of(told, "depart", robot="seer")
    assert resolved["robot"] == "seer" and resolved["at"] == start
    assert told.index(resolved) < told.index(steps[0])
    if clock is Clock.LOCKSTEP and world is None:
        monkeypatch.setattr(Actions, "acts_first", lambda *_: False)
        assert "missed-resolution" in {f.rule for f in check_trace(map(json.dumps, run())).findings}


PASSING = """
safenav: 1
name: one leaves where the other arrives
map: {grid: ["##########", "#........#", "##########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [push]}
    kite: {mobility: free, layer: air, capabilities: [push]}
  obstacles:
    gate: {needs: [{action: push, robots: 2, together: true, at: [[1, 4]]}, {action: push}]}
robots:
  a: {model: cart, start: [1, 3], objective: {visit: [[1, 6]]}}
  b: {model: kite, start: [1, 2], objective: {visit: [[1, 4]]}}
obstacles: [{type: gate, region: [1, 8]}]
until: {rounds: 1}
clock: live
"""


class AtOnce(LiveSimulation):
    """Its actions take no time, and it does not say what they have brought on."""

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
        del obstacles
        return Acted(self.now(), robot.name, command=command)


@pytest.mark.parametrize("world", [LiveSimulation, AtOnce])
@pytest.mark.parametrize("speed", [7.0, 14.0], ids=["apart", "together"])
def test_a_robot_on_its_way_takes_part_in_nothing(speed: float, world: Any) -> None:
    """What takes two that stand there is not met by one that arrives when the other has left."""
    scenario, told = load_scenario_text(PASSING), list[dict[str, Any]]()
    place = world(scenario, speeds={"b": speed})
    mission = Mission(scenario, world=place, listeners=[lambda r: told.append(as_data(r))])
    assert mission.run().outcome == "completed"
    for kind in ("met", *(["act"] if world is LiveSimulation else [])):
        assert bool(of(told, kind)) == (speed == 14.0), kind
    assert check_trace(map(json.dumps, told)).findings == ()


@pytest.mark.parametrize("place", ["[1, 5]", "[2, 5]", "[1, 6]"])
def test_blocking_calls_resolve_what_the_simulation_does(place: str) -> None:
    """Where a robot starts, by its first step, or later: in the same ticks."""
    suspect = SUSPECT.replace("[1, 5]", place)
    scenario = load_scenario_text(STARTS % suspect)
    resolved = []
    for world in (SimulatedWorld(scenario), Calls(scenario)):
        told: list[dict[str, Any]] = []
        Mission(scenario, world=world, listeners=[lambda r: told.append(as_data(r))]).run()  # noqa: B023
        resolved.append([(line["tick"], line["at"]) for line in of(told, "resolved")])
    assert resolved[0] == resolved[1] != []


@pytest.mark.parametrize(
    ("first", "told"),
    [
        (OSError("no answer of its arm"), "act: no answer of its arm"),
        (Arrived(0.0, "b"), "Arrived ends no action"),
        (Acted(0.0, "b", ("door",)), "its results are ('door',)"),  # type: ignore[arg-type]
        (Acted(0.0, "b", reason="it jams"), "it jams"),
        (None, "no end within 10.0 s"),
    ],
    ids=["exception", "event", "results", "reason", "silent"],
)
@pytest.mark.parametrize("known", [False, True], ids=["first", "debris"])
def test_the_trace_says_why_an_action_has_failed(
    first: WorldEvent | Exception | None, told: str, known: bool, tmp_path: Path
) -> None:
    """Where the robot was to act on what the team knows, and where it starts; then it goes on."""

    class Wrong(LiveSimulation):
        failed = False

        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            if robot.name != "b" or self.failed:
                return super().act(robot, obstacles, command)
            if known and not obstacles:
                return Acted(self.now(), "b", command=command)  # it sees nothing there yet
            self.failed = True
            if isinstance(first, Exception):
                raise first
            return first and replace(first, at=self.now(), command=command)

    scenario = load_scenario_text(DEBRIS + "failures: {timeout: 5}\n")
    trace, story = tmp_path / "trace.jsonl", list[str]()
    with TraceWriter(trace) as writer:
        listeners = [writer, Story(scenario, story.append)]
        result = Mission(scenario, world=Wrong(scenario), listeners=listeners).run()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    assert result.outcome == "completed", result.explanation
    (failed,) = [line for line in of(lines, "acted") if "reason" in line]
    assert (failed["robot"], failed["reason"]) == ("b", told)
    assert failed["results"] == ({"debris@24": "failed"} if known else {})
    assert any(told in line for line in story)
    assert check_trace(trace).findings == ()


def test_an_action_that_finds_nothing_is_not_repeated(tmp_path: Path) -> None:
    """Also where the world takes its time to say so."""

    class Slow(LiveSimulation):
        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            found = super().act(robot, obstacles, command)
            if found is not None:
                self._push(0.5, found, robot)

    scenario, trace = load_scenario_text(RING), tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        result = Mission(scenario, world=Slow(scenario), listeners=[writer]).run()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    assert result.outcome == "completed"
    assert len(of(lines, "act")) <= len(of(lines, "arrive")) + len(scenario.robots) + 1


def test_a_command_that_does_not_end_is_cancelled_and_its_robot_lost(tmp_path: Path) -> None:
    class Silent(Faulty):
        cancelled = 0

        def cancel(self, robot: Robot) -> None:
            self.cancelled += robot.name == "a"

    scenario = replace(load_scenario_text(RING), failures=Failures(timeout=30.0))
    world = Silent(scenario, nth(2, lambda *_: []))
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        Mission(scenario, world=world, listeners=[writer]).run()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    (lost,) = of(lines, "arrive", result="lost")
    (depart,) = of(lines, "depart", command=lost["command"])
    assert world.cancelled == 1 and lost["t"] - depart["t"] == pytest.approx(60, abs=0.01)


def test_a_live_run_waits_for_an_operator() -> None:
    scenario = replace(load_scenario(SCENARIOS / "case_study_1.yaml"), clock=Clock.LIVE)
    robots = tuple(
        replace(r, model=replace(r.model, capabilities=frozenset())) for r in scenario.robots
    )
    mission = Mission(replace(scenario, robots=robots), attended=True)
    mission.start()
    for _ in range(2000):
        if mission.waiting is not None or mission.result is not None:
            break
        mission.step()
    assert mission.result is None and mission.waiting is not None
    assert mission.waiting.outcome == "operator_needed" and mission.waiting.proof is not None
    assert mission.give_up().outcome == "interrupted"


def test_strategies_that_rely_on_the_speed_of_others_are_refused() -> None:
    text = (SCENARIOS / "case_study_1_beliefs.yaml").read_text()
    scenario = load_scenario_text(text.replace("tracks:", "avoids:"))
    with pytest.raises(UsageError, match="digit has 'tracking: belief': its strategy assumes"):
        Mission(replace(scenario, clock=Clock.LIVE))


@pytest.mark.parametrize(
    ("waits", "busy", "found"),
    [
        ({"a": [], "b": []}, [], {"a", "b"}),
        ({"a": ["b"], "b": ["a"]}, [], {"a", "b"}),
        ({"a": ["b"], "b": ["c"], "c": []}, ["c"], set()),
        ({"a": ["b"], "b": ["a"], "c": ["d"], "d": []}, ["d"], {"a", "b"}),
    ],
)
def test_robots_that_wait_only_for_robots_that_wait(
    waits: dict[str, list[str]], busy: list[str], found: set[str]
) -> None:
    assert still(waits, busy) == found


def test_a_plan_begins_with_the_steps_under_way() -> None:
    """Robot 1 set out from 4 to 5: its way begins in 4, and the others stay meanwhile."""
    states = [Joint((1, 5), ((0, 0, 0),) * 2, ()), Joint((2, 6), ((0, 0, 0), (1, 0, 0)), ())]
    counts = ((0, 0, 0),) * 2
    poses, after = with_steps_under_way([s.poses for s in states], states, counts, {1: 4})
    assert poses == [(1, 4), (1, 5), (2, 6)]
    assert [state.poses for state in after] == [(1, 4), (1, 5), (2, 6)]
    plan = schedule(poses, [9, 9], [frozenset({1}), frozenset({0})])
    assert plan.ways == ((1, 2), (4, 5, 6))
    assert with_steps_under_way([(1, 5)], states, counts, {}) == ([(1, 5)], states)


def test_reactions_to_failed_moves() -> None:
    policy, troubles = Failures(retries=1, most=4), Troubles()
    fail = [troubles.move_failed(policy, "a", region, fatal=False) for region in (1, 1, 2)]
    assert fail == [Reaction.RETRY, Reaction.OBSTACLE, Reaction.RETRY]
    assert troubles.move_failed(policy, "b", 1, fatal=True) is Reaction.OUT_OF_SERVICE
    assert troubles.move_failed(policy, "a", 3, fatal=False) is Reaction.OUT_OF_SERVICE
    troubles.arrived("a")
    assert troubles.move_failed(policy, "a", 1, fatal=False) is Reaction.RETRY
