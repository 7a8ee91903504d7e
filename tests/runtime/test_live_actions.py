"""Live runs: actions of robots on obstacles where they start, arrive and stand."""

from collections.abc import Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from once import beside
from runtime.played import Run, completed, loaded
from runtime.test_live import RING
from runtime.worlds import Driven
from safenav import Mission
from safenav.report.terminal.story import Story
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.protocol import (
    Acted,
    Arrived,
    WorldEvent,
)
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.settings import Clock, Failures
from safenav.trace.vocabulary import ActResult
from safenav.world.moves import Pose

DEBRIS = RING.replace("type: door", "type: debris").replace(
    "capabilities: [push]}}}",
    "capabilities: [clear]}}, obstacles: {debris: {action: clear, resolve_at: neighbours}}}",
)


@pytest.mark.parametrize("unasked", [False, True])
def test_after_two_failed_actions_another_robot_helps(unasked: bool) -> None:
    """``unasked``: its arm acts on whatever is there, also if the action names no obstacle."""
    (debris,) = loaded(DEBRIS).obstacles

    class Jammed(LiveSimulation):
        left = unasked

        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            if robot.name == "a":
                self.left = self.left and not obstacles
                return super().act(robot, obstacles, command)
            tried = obstacles or ([debris] if self.left and self.now() > 1 else [])
            found = tuple((obstacle, ActResult.FAILED) for obstacle in tried)
            return Acted(self.now(), "b", found, command=command)

    run = completed(DEBRIS, world=Jammed)
    assert len(run.all("acted", robot="b")) == 2
    assert run.one("request", helpers=["a"])["because"] == "b has failed"
    assert run.one("resolved")["robot"] == "a"


@pytest.mark.parametrize("fails", [0, 1, 2])
def test_a_failed_push_reports_the_door_to_the_team(fails: int) -> None:
    """The robot that has entered the door pushes again, and does not pass until it is open."""

    class Jammed(LiveSimulation):
        left = fails

        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            if self._poses[robot.name].region != door.region or self.left == 0:
                return super().act(robot, obstacles, command)
            self.left -= 1
            return Acted(self.now(), robot.name, ((door, ActResult.FAILED),), command=command)

    scenario, run = loaded(RING), Run()
    (door,) = scenario.obstacles
    Mission(scenario, world=Jammed(scenario), listeners=[run]).run()
    assert run.outcome["outcome"] == "completed" and not run.findings
    assert {line["result"] for line in run.all("arrive")} == {"arrived"} and not run.all("late")
    assert len(run.all("violation", at=door.region)) == (fails > 0)
    leaves = run.records.index(run.all("depart", **{"from": door.region})[0])
    assert fails > 1 or run.records.index(run.one("resolved")) < leaves


STARTS = """
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
"""
SUSPECT = "{type: uncertainty, region: [1, 5], traversable: true}"
CRATE = "{type: crate, region: [1, 3]}"


class Calls(Driven):
    """The simulation, which does not say before what a robot can do. It learns from the moves which
    robots there are."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.there = set[str]()

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        self.there.add(robot.name)
        return super().move(robot, pose)

    def act(self, robot: Robot) -> Any:
        assert robot.name in self.there
        return super().act(robot)


@pytest.mark.parametrize(
    ("obstacle", "clock", "world"),
    [
        (SUSPECT, Clock.LOCKSTEP, None),
        (SUSPECT, Clock.LOCKSTEP, Calls),
        (SUSPECT, Clock.LIVE, None),
        (CRATE, Clock.LOCKSTEP, None),  # its second need comes after the robot that meets it
    ],
)
def test_robots_act_at_their_start_before_they_leave_it(
    obstacle: str, clock: Clock, world: Any
) -> None:
    """On both clocks; in lockstep the tick is used up by that."""
    scenario = replace(loaded(STARTS % obstacle), clock=clock)
    run = completed(scenario, world=world and world(scenario))
    resolved = run.one("resolved")
    steps = [m for m in run.all("move", robot="seer") if m["to"] != m["from"]]
    steps += run.all("depart", robot="seer")
    assert (resolved["robot"], resolved["at"]) == ("seer", scenario.robots[1].start.region)
    assert run.records.index(resolved) < run.records.index(steps[0])


PASSING = beside(__file__, "scenarios/live_actions_passing.yaml")


@pytest.mark.parametrize("result", ActResult)
def test_a_world_that_repeats_a_result_is_not_commanded_forever(result: ActResult) -> None:
    """It answers immediately, about what it was not asked to act on; no time passes meanwhile."""
    scenario = loaded(PASSING)
    asked: list[str] = []

    class Echo(LiveSimulation):
        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            del obstacles
            asked.append(robot.name)
            found = ((scenario.obstacles[0], result),)
            return Acted(self.now(), robot.name, found, command=command)

    run = Run()
    Mission(scenario, world=Echo(scenario), listeners=[run]).run()
    assert run.outcome["outcome"] == "completed"
    assert 0 < len(asked) <= 2 * len(run.all("arrive")) + 2 * len(scenario.robots)
    told = {line["reason"] for line in run.all("late")}
    assert told == {f"it adds nothing to the knowledge (gate@18: {result.value})"}
    assert len(run.all("resolved")) == (result in (ActResult.DONE, ActResult.UNTRAVERSABLE))
    if result in (ActResult.FAILED, ActResult.NOTHING):
        assert not run.findings


@pytest.mark.parametrize("speed", [7.0, 14.0], ids=["apart", "together"])
def test_a_robot_in_transit_takes_part_in_no_joint_action(speed: float) -> None:
    """What takes two that stand there is not met by one that arrives when the other has left."""
    scenario = loaded(PASSING)
    run = completed(scenario, world=LiveSimulation(scenario, speeds={"b": speed}))
    for kind in ("met", "act"):
        assert bool(run.all(kind)) == (speed == 14.0), kind


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
def test_the_trace_records_why_an_action_has_failed(
    first: WorldEvent | Exception | None, told: str, known: bool
) -> None:
    """Where the robot was to act on what the team knows, and where it starts; then it continues."""

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

    scenario = replace(loaded(DEBRIS), failures=Failures(timeout=5))
    run, story = Run(), list[str]()
    listeners = [run, Story(scenario, story.append)]
    result = Mission(scenario, world=Wrong(scenario), listeners=listeners).run()
    assert result.outcome == "completed", result.explanation
    (failed,) = [line for line in run.all("acted") if "reason" in line]
    assert (failed["robot"], failed["reason"]) == ("b", told)
    assert failed["results"] == ({"debris@24": "failed"} if known else {})
    assert any(told in line for line in story)
    assert not run.findings


ONE_LOAD = """
name: two robots where a parcel is ordered
map: {grid: ["##########", "#........#", "##########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [lift]}
    kite: {mobility: free, layer: air, capabilities: [lift]}
  obstacles:
    parcel:
      needs: [{action: lift, robots: %s, at: [[1, 4]]}, {action: lift, at: [[1, 7]], same: true}]
      blocks: []
robots:
  a: {model: cart, start: [1, 4], objective: {hold: [1, 4]}}
  b: {model: kite, start: [1, 4], objective: {hold: [1, 4]}}
orders: [{at: 2, type: parcel, region: [1, 4]}]
until: {rounds: 1}
clock: live
"""


@pytest.mark.parametrize(
    ("robots", "breaks", "sent"),
    [
        ("1", False, [["a"], ["a"]]),
        ("1", True, [["a"], ["b"], ["b"]]),
        ("2", False, [["a"], ["b"], ["a"], ["b"]]),
        ("2, together: true", False, [["a", "b"], ["a"], ["b"]]),
    ],
    ids=["one", "one fails", "two", "together"],
)
def test_no_robot_acts_where_enough_others_already_do(
    robots: str, breaks: bool, sent: list[list[str]]
) -> None:
    """Of two that stand where a parcel is, as many take it as it needs; the other one acts only if
    they fail. None is told that it failed because others were faster."""

    class Weak(LiveSimulation):
        def _happens(self, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle]) -> Any:
            if not (breaks and robot.name == "a" and isinstance(event, Acted)):
                return super()._happens(event, robot, missing)
            return replace(event, at=self._now, found=((parcel, ActResult.FAILED),))

    scenario = replace(loaded(ONE_LOAD % robots), failures=Failures(actions=1))
    (parcel,) = scenario.obstacles
    run = completed(scenario, world=Weak(scenario))
    done = [line["robots"] for line in run.all("act") if line["obstacles"]]
    failed = [r["robot"] for r in run.all("acted") if "failed" in r["results"].values()]
    assert (done, failed) == (sent, ["a"] if breaks else [])
