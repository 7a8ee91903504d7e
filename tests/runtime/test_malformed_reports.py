"""External live worlds with reports of wrong types: a run names them, and never crashes."""

import math
import re
from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from runtime.played import Run, loaded
from runtime.test_live import nth, play_faulty
from safenav import Mission
from safenav.errors import ExitCode
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.lockstep import WorldError
from safenav.runtime.worlds.protocol import (
    Arrived,
    Blocked,
    Elsewhere,
    Failed,
    Lost,
    Sensed,
    WorldEvent,
)
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.settings import Failures
from safenav.world.moves import Pose

SCENARIO = """
map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
robots:
  a: {model: quadcopter, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}
  b: {model: digit, start: [3, 2], heading: east, objective: {once: [[3, 4]]}}
until: {rounds: 1}
clock: live
"""
DOOR = built_in().obstacles["door"]


def play(report: Callable[[Arrived], Any], *, beside: bool) -> Run:
    """Instead of the second arrival of ``a``, or beside it, something else is reported."""
    run = play_faulty(nth(2, lambda _, e: [report(e), e] if beside else [report(e)]), SCENARIO)
    assert not {"names", "arrive", "late"} & {*run.broken}
    return run


ENDS: list[tuple[Callable[[Arrived], Any], str]] = [
    (lambda e: Elsewhere(e.at, "a", Pose("9"), command=e.command), "region '9' is not an int"),  # type: ignore[arg-type]
    (lambda e: Elsewhere(e.at, "a", Pose(9, "up"), command=e.command), "its heading is 'up'"),  # type: ignore[arg-type]
    (lambda e: Lost(e.at, "a", [9], command=e.command), r"its regions is \[9\], not frozenset"),  # type: ignore[arg-type]
    (lambda e: Lost(e.at, "a", frozenset(), command=e.command), "names no region"),
    (lambda e: Failed(e.at, "a", None, "", command=e.command), "its pose is None, not Pose"),  # type: ignore[arg-type]
    (lambda e: Blocked(e.at, "a", Pose(9), "door", command=e.command), "'door', not Obstacle"),  # type: ignore[arg-type]
    (lambda e: Failed(e.at, "a", Pose(9), 42, command=e.command), "its reason is 42, not str"),  # type: ignore[arg-type]
    (lambda e: Arrived("now", "a", command=e.command), "its time is 'now', not seconds"),  # type: ignore[arg-type]
    (lambda e: Arrived(math.nan, "a", command=e.command), "its time is nan, not seconds"),
    (
        lambda e: Blocked(e.at, "a", Pose(9), Obstacle(DOOR, 26), command=e.command),
        "blocked by door@26, which is not in region 10",
    ),
]
"""Ends of a step."""


@pytest.mark.parametrize(("report", "reason"), ENDS, ids=[reason for _, reason in ENDS])
def test_a_malformed_end_of_a_step_makes_the_robot_lost(
    report: Callable[[Arrived], Any], reason: str
) -> None:
    run = play(report, beside=False)
    lost = run.one("arrive", result="lost")
    assert {9, 10} == {*lost["regions"]}
    assert lost["reason"] and re.search(reason, lost["reason"])
    assert run.outcome["cause"] == "out_of_service"


BESIDE: list[tuple[Callable[[Arrived], Any], str]] = [
    (lambda e: Arrived(e.at, "nobody", command=e.command), "no robot is named 'nobody'"),
    (lambda e: Sensed(e.at, Obstacle(DOOR, 29), by="nobody"), "no robot is named 'nobody'"),
    (lambda e: Sensed(e.at, "door"), "its obstacle is 'door', not Obstacle"),  # type: ignore[arg-type]
    (lambda _: Sensed("now", Obstacle(DOOR, 29), there=False), "its time is 'now'"),  # type: ignore[arg-type]
    (lambda _: "arrived", "'arrived' is not an event"),
    (lambda e: Arrived(e.at, "a"), "it names no command (command=, the number"),
    (lambda e: Arrived(e.at, "a", command=str(e.command)), "its command is '"),  # type: ignore[arg-type]
]
"""Reports beside the ends of commands."""


@pytest.mark.parametrize(("report", "reason"), BESIDE, ids=[reason for _, reason in BESIDE])
def test_malformed_reports_beside_the_ends_of_commands_are_dropped(
    report: Callable[[Arrived], Any], reason: str
) -> None:
    run = play(report, beside=True)
    assert run.outcome["outcome"] == "completed"
    (late,) = run.all("late")
    assert reason in late["reason"]
    of_a = reason.startswith(("it names no command", "its command"))
    assert (late["event"], late.get("robot")) == ("arrived", "a") or not of_a
    assert late.get("robot") in (None, "a")


@pytest.mark.parametrize("answer", [True, 7, Pose(9)])
def test_a_command_with_a_malformed_reply_has_failed(answer: Any) -> None:
    class Answering(LiveSimulation):
        def start(self, robot: Robot, pose: Pose, command: int) -> Any:
            return answer if robot.name == "a" else super().start(robot, pose, command)

    scenario, run = loaded(SCENARIO), Run()
    Mission(scenario, world=Answering(scenario), listeners=[run]).run()
    failed = run.one("arrive", robot="a", result="failed")
    assert "neither None nor an event" in failed["reason"]
    assert run.outcome["cause"] == "out_of_service"


def broken() -> float:
    raise OSError("no route to the clock")


@pytest.mark.parametrize(
    ("clock", "told"),
    [
        (lambda: "12", r"World.now\(\) returned '12', not seconds"),
        (lambda: math.nan, r"World.now\(\) returned nan, not seconds"),
        (lambda: 10**400, r"World.now\(\) returned 1000"),
        (broken, r"World.now\(\) failed: OSError: no route to the clock"),
    ],
)
def test_a_clock_that_returns_no_time_is_reported(clock: Callable[[], Any], told: str) -> None:
    scenario = loaded(SCENARIO)
    world = LiveSimulation(scenario)
    world.now = clock  # type: ignore[method-assign]
    with pytest.raises(WorldError, match=told) as caught:
        Mission(scenario, world=world).run()
    assert caught.value.exit_code is ExitCode.INTERNAL


def test_a_robot_is_lost_although_its_world_cannot_cancel_the_command() -> None:
    class Deaf(LiveSimulation):
        def wait(self, timeout: float | None) -> list[WorldEvent]:
            return [e for e in super().wait(timeout) if getattr(e, "robot", None) != "a"]

        def cancel(self, robot: Robot) -> None:
            raise OSError(f"no connection to {robot.name}")

    scenario, run = replace(loaded(SCENARIO), failures=Failures(timeout=20)), Run()
    Mission(scenario, world=Deaf(scenario), listeners=[run]).run()
    reason = run.one("arrive", result="lost")["reason"]
    assert reason == "no end within 20.0 s after it was cancelled (cancel: no connection to a)"
