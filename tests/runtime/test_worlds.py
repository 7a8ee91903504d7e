"""Worlds with impossible answers and malformed reports: an error names the call, a robot is lost or
the report dropped; what goes wrong in true reports is ``cases/failures`` and ``cases/outside``."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import click
import pytest
from msgspec.structs import replace

from runtime.facts import case
from runtime.played import Run, begin, completed, loaded, play
from runtime.worlds import Bare, Driven, Faulty
from safenav import Mission
from safenav.errors import ExitCode
from safenav.report.terminal.story import Story
from safenav.runtime.worlds.lockstep import WorldError
from safenav.runtime.worlds.protocol import (
    Acted,
    Arrived,
    Blocked,
    Change,
    Elsewhere,
    Failed,
    Lost,
    Sensed,
    WorldEvent,
)
from safenav.runtime.worlds.simulation import LiveSimulation, SimulatedWorld
from safenav.scenario.model import Failures, Need, Obstacle, Robot, Scenario
from safenav.scenario.reading.catalogue import built_in
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Heading
from safenav.world.poses import Pose

SCENARIO = """
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  drone: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}
inputs: {alarm: {at: 3}}
until: {rounds: 1}
"""
DOOR, FOG = built_in().obstacles["door"], built_in().obstacles["uncertainty"]
SAME = replace(DOOR, listed=(Need("push", same=True),))
TWO = replace(DOOR, listed=(Need("push"), Need("push", robots=2, same=True)))


def broken(*_: Any) -> Any:
    raise RuntimeError("the radio is off")


def generates(*_: Any) -> Any:
    yield Obstacle(FOG, 10), True
    raise OSError("no more")


def says(value: Any) -> Callable[..., Any]:
    return lambda *_: value


@pytest.mark.parametrize(
    ("call", "answer", "told"),
    [
        ("sense", broken, r"World.sense\('drone', 9\) failed: RuntimeError: the radio is off"),
        ("sense", says("a door"), r"World.sense\('drone', 9\): 'a door' is not an Obstacle"),
        ("sense", says(Obstacle(DOOR, 99)), r"sense\('drone', 9\): door@99 is in a wall or off"),
        ("sense", says(Obstacle(DOOR, 11)), r"door@11 is not in the requested region"),
        ("sense", says(Obstacle("door", 9)), "region 9 has a wrong part: `type` must be an object"),  # type: ignore[arg-type]
        ("sense", says(Obstacle(DOOR, 9, resolve_within=-4)), "wrong part: `resolve_within`"),
        ("sense", says(Obstacle(SAME, 9)), "region 9 has no previous need for 'same'"),
        ("sense", says(Obstacle(TWO, 9)), "other numbers of robots for a 'same' need"),
        ("inputs", says(None), r"World.inputs\(1\) failed: AttributeError"),
        ("inputs", says({"alarm": "off"}), r"inputs\(1\) .* alarm is 'off', not True or False"),
        ("move", says(9), r"move\('drone', 9\): it returned 9, which has a wrong part"),
        ("move", says(Pose(400)), r"move\('drone', 9\): region 400 is a wall or off the map"),
        ("move", says(Pose(8.0)), "which has a wrong part: `region` must be a whole number"),  # type: ignore[arg-type]
        ("move", says(Pose(9, Heading.EAST)), "drone is a robot of free mobility"),
        ("act", generates, r"World.act\('drone'\) failed: OSError: no more"),
        ("act", says([Obstacle(FOG, 10)]), "has a wrong part: `` must be a list, not an object"),
        ("act", says([(Obstacle(FOG, 10), "yes")]), r"`\[1\]` must be true or false or null"),
        ("act", says([(Obstacle(DOOR, 9), None)]), r"drone cannot 'push' door@9"),
        ("act", says([(Obstacle(FOG, 12), True)]), r"drone is at 8; .* can be resolved at 11"),
        ("changes", says([Obstacle(DOOR, 9)]), r"World.changes\(1\): .* has a wrong part"),
        ("changes", says([Change(Obstacle(DOOR, 8), True)]), "door@8 appears where a robot is"),
    ],
)
def test_an_inconsistent_world_is_an_error_with_its_reason(
    call: str, answer: Callable[..., Any], told: str
) -> None:
    scenario, run = loaded(SCENARIO), Run()
    world = (Driven if call == "act" else SimulatedWorld)(scenario)
    setattr(world, call, answer)
    with pytest.raises(WorldError, match=told) as caught:
        Mission(scenario, world=world, listeners=[run]).run()
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert run.outcome is run.records[-1]
    assert run.outcome["outcome"] == "error" and call in run.outcome["explanation"]
    assert not run.findings


RING = case("failures/ring")
Report = Callable[[Arrived], Any]


class Told(Faulty):
    """Instead of the second arrival of ``a`` something else is reported."""

    def __init__(self, scenario: Scenario, report: Callable[[Arrived], Sequence[Any]]) -> None:
        super().__init__(scenario, [["a", 2, "told"]])
        self.report = report

    def _struck(self, event: Arrived, what: str, where: list[Any]) -> Sequence[Any]:
        del what, where
        return self.report(event)


@pytest.mark.parametrize(
    ("report", "reason"),
    [
        (
            lambda e: Elsewhere(e.at, "a", Pose(9, "up"), command=e.command),
            "`pose.heading` must be",
        ),  # type: ignore[arg-type]
        (lambda e: Failed(e.at, "a", None, "", command=e.command), "`pose` must be an object"),  # type: ignore[arg-type]
        (lambda e: Lost(e.at, "a", frozenset(), command=e.command), "names no region"),
        (lambda e: Arrived("now", "a", command=e.command), "its time is 'now', not seconds"),  # type: ignore[arg-type]
        (lambda e: Arrived(math.nan, "a", command=e.command), "its time is nan, not seconds"),
        (
            lambda e: Blocked(e.at, "a", Pose(9), Obstacle(DOOR, 26), command=e.command),
            "blocked by door@26, which is not in region 10",
        ),
    ],
)
def test_a_malformed_end_of_a_step_makes_the_robot_lost(report: Report, reason: str) -> None:
    run = play(RING, world=lambda scenario: Told(scenario, lambda event: [report(event)]))
    lost = run.one("arrive", result="lost")
    assert {9, 10} == {*lost["regions"]} and reason in lost["reason"]
    assert run.outcome["cause"] == "out_of_service"


@pytest.mark.parametrize(
    ("report", "reason"),
    [
        (lambda e: Sensed(e.at, Obstacle(DOOR, 29), by="nobody"), "no robot is named 'nobody'"),
        (lambda e: Sensed(e.at, "door"), "`obstacle` must be an object"),  # type: ignore[arg-type]
        (lambda _: Sensed("now", Obstacle(DOOR, 29), there=False), "its time is 'now'"),  # type: ignore[arg-type]
        (lambda _: "arrived", "'arrived' is not an event"),
        (lambda e: Arrived(e.at, "a"), "it names no command (command=, the number"),
        (lambda e: Arrived(e.at, "a", command=str(e.command)), "`command` must be a whole"),  # type: ignore[arg-type]
    ],
)
def test_malformed_reports_beside_the_ends_of_commands_are_dropped(
    report: Report, reason: str
) -> None:
    run = completed(RING, world=lambda s: Told(s, lambda event: [report(event), event]))
    (late,) = run.all("late")
    assert reason in late["reason"]
    of_a = "command" in reason
    assert (late["event"], late.get("robot")) == ("arrived", "a") or not of_a


@pytest.mark.parametrize("answer", [True, Pose(9)])
def test_a_command_with_a_malformed_reply_has_failed(answer: Any) -> None:
    class Answering(LiveSimulation):
        def start(self, robot: Robot, pose: Pose, command: int) -> Any:
            return answer if robot.name == "a" else super().start(robot, pose, command)

    run = play(RING, world=Answering)
    failed = run.one("arrive", robot="a", result="failed")
    assert "neither None nor an event" in failed["reason"]
    assert run.outcome["cause"] == "out_of_service"


@pytest.mark.parametrize(
    ("clock", "told"),
    [
        (says("12"), r"World.now\(\) returned '12', not seconds"),
        (says(10**400), r"World.now\(\) returned 1000"),
        (broken, r"World.now\(\) failed: RuntimeError: the radio is off"),
    ],
)
def test_a_clock_that_returns_no_time_is_reported(clock: Callable[[], Any], told: str) -> None:
    scenario = loaded(RING)
    world = LiveSimulation(scenario)
    world.now = clock  # type: ignore[method-assign]
    with pytest.raises(WorldError, match=told):
        Mission(scenario, world=world).run()


def test_a_robot_is_lost_although_its_world_cannot_cancel_the_command() -> None:
    class Deaf(LiveSimulation):
        def wait(self, timeout: float | None) -> list[WorldEvent]:
            return [e for e in super().wait(timeout) if getattr(e, "robot", None) != "a"]

        def cancel(self, robot: Robot) -> None:
            raise OSError(f"no connection to {robot.name}")

    scenario = replace(loaded(RING), failures=Failures(timeout=20))
    reason = play(scenario, world=Deaf).one("arrive", result="lost")["reason"]
    assert reason == "no end within 20.0 s after it was cancelled (cancel: no connection to a)"


class SinceEpoch(Bare):
    """A clock of seconds since 1970 that advances only by waits: by nothing if they are short. No
    step ends before it is cancelled."""

    def __init__(self) -> None:
        super().__init__()
        self.time, self.waits = 1.7e9, 0

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        del robot, pose, command

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        self.waits += 1
        assert self.waits < 2000, f"no time passes in wait({timeout})"
        return super().wait(timeout)


@pytest.mark.parametrize("timeout", [1.1, 1.7])
def test_waits_are_long_enough_for_clocks_that_advance_by_them(timeout: float) -> None:
    scenario = replace(loaded(RING), failures=Failures(timeout=timeout))
    lost = play(scenario, world=SinceEpoch()).all("arrive", result="lost")
    assert {line["robot"] for line in lost} == {"a", "b"}
    assert [line["t"] for line in lost] == [pytest.approx(2 * timeout, abs=0.2)] * 2


class Sudden(Bare):
    """Steps take no time by the world's clock, but for each seventh, which takes half a second."""

    step, steps = 0.5, 0

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        self.steps += 1
        if self.steps % 7:
            return Arrived(self.time, robot.name, command=command)
        return super().start(robot, pose, command)


def test_steps_that_take_no_time_make_the_patience_no_shorter_than_a_second() -> None:
    world = Sudden()
    run = completed(RING, world=world)
    assert world.steps > 14 and not run.all("arrive", result="lost")


@pytest.mark.parametrize("result", ActResult)
def test_a_world_that_repeats_a_result_is_not_commanded_forever(result: ActResult) -> None:
    """It answers immediately, about what it was not asked to act on; no time passes meanwhile."""
    scenario, asked, run = loaded(case("outside/no_joint_action_in_transit")), list[str](), Run()

    class Echo(LiveSimulation):
        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            del obstacles
            asked.append(robot.name)
            found = ((scenario.obstacles[0], result),)
            return Acted(self.now(), robot.name, found, command=command)

    Mission(scenario, world=Echo(scenario), listeners=[run]).run()
    assert run.outcome["outcome"] == "completed"
    assert 0 < len(asked) <= 2 * len(run.all("arrive")) + 2 * len(scenario.robots)
    told = {line["reason"] for line in run.all("late")}
    assert told == {f"it adds nothing to the knowledge (gate@18: {result.value})"}
    assert len(run.all("resolved")) == (result in (ActResult.DONE, ActResult.UNTRAVERSABLE))


@pytest.mark.parametrize(
    ("first", "told", "known"),
    [
        (OSError("no answer of its arm"), "act: no answer of its arm", True),
        (OSError("no answer of its arm"), "act: no answer of its arm", False),
        (Arrived(0.0, "b"), "Arrived ends no action", True),
        (Acted(0.0, "b", ("door",)), "it has a wrong part: `found[0]`", False),  # type: ignore[arg-type]
        (Acted(0.0, "b", reason="it jams"), "it jams", True),
        (None, "no end within 10.0 s", False),
    ],
)
def test_the_trace_records_why_an_action_has_failed(
    first: WorldEvent | Exception | None, told: str, known: bool
) -> None:
    """Where the robot was to act on what the team knows, or where it starts; then it continues."""

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

    scenario = replace(loaded(case("failures/debris")), failures=Failures(timeout=5))
    run, story = Run(), list[str]()
    listeners = [run, Story(scenario, story.append)]
    result = Mission(scenario, world=Wrong(scenario), listeners=listeners).run()
    assert result.outcome == "completed", result.explanation
    (failed,) = [line for line in run.all("acted") if "reason" in line]
    assert failed["robot"] == "b" and failed["reason"].startswith(told)
    assert failed["results"] == ({"debris@24": "failed"} if known else {})
    assert any(told in click.unstyle(line) for line in story) and not run.findings


def test_a_program_that_steps_itself_can_give_up() -> None:
    mission, run = begin(SCENARIO, world=Driven)
    for _ in range(3):
        mission.step()
    result = mission.give_up("battery low")
    assert mission.give_up("again") is mission.result is result
    last = run.records[-1]
    assert (last["outcome"], last["explanation"]) == ("interrupted", "battery low")
    assert not run.findings


def test_a_blocking_world_makes_a_step_of_several_ticks_when_it_begins() -> None:
    scenario = loaded(case("outside/slow_step_ends_elsewhere"))
    world = Driven(scenario)
    mission, run = begin(scenario, world=world)
    mission.step()
    assert run.one("move", robot="slow")["toward"] == 27 and world.count["slow"] == 1


class Outside(Driven):
    """A world of a user: no simulation, it does what it is told."""

    def act(self, robot: Robot) -> Any:
        self.truth.changes(10**6, ())  # what is ordered is there
        return super().act(robot)


def test_orders_reach_the_team_in_another_world() -> None:
    assert completed(case("orders/of_an_operator"), world=Outside).all("order")
