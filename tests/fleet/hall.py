"""A hall with two robots over a transport that follows a script."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from safenav.fleet import transport
from safenav.fleet.file import Station
from safenav.fleet.goals import FleetClock
from safenav.fleet.world import FleetWorld
from safenav.runtime.worlds.protocol import WorldEvent
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Heading
from safenav.world.poses import Pose

SCENARIO = """\
safenav: 1
name: hall
map:
  resolution: {resolution}
  grid: |
    #######
    #.....#
    #.....#
    #######
robots:
  {{digit: {{model: digit, start: 8, heading: east, objective: {{visit: [8, 12]}}}},
   quad: {{model: quadcopter, start: 15, objective: {{visit: [15, 19]}}}}}}
"""
ENDS = {end.value: end for end in transport.GoalEnd}


class Robots:
    """A transport whose robots do what a script says, goal by goal: the end of the goal, and the
    robot's position then (in regions east of its start; None: no more messages). Time passes during
    waits."""

    def __init__(self, side: float = 1.0) -> None:
        self.side = side
        self.script: list[tuple[str | None, float | None]] = []
        self.results: list[tuple[ActResult, str]] = []
        self.goals: list[transport.GoalPoint] = []
        self.cancelled: list[str] = []
        self.stamp = self.now = 0.0
        self.clock = FleetClock(lambda: self.now, self.step)
        self.x = {"digit": 1.5, "quad": 1.5}
        self.y = {"digit": 2.5, "quad": 1.5}
        self.post: Callable[[transport.Message], None] = print
        self.closed = False

    def step(self) -> None:
        self.now += 0.01

    def open(self, post: Callable[[transport.Message], None]) -> None:
        self.post = post
        for name in self.x:
            self.locate(name)

    def locate(self, name: str, yaw: float = 0.0) -> None:
        self.stamp += 1.0
        x, y = self.x[name] * self.side, self.y[name] * self.side
        self.post(transport.Located(name, self.stamp, x, y, yaw))

    def missing(self) -> list[str]:
        return [] if "digit" in self.x else ["/digit/move_base"]

    def navigate(self, robot: str, goal: transport.GoalPoint) -> None:
        self.goals.append(goal)
        end, at = self.script.pop(0)
        if at is not None:
            self.x[robot] = at
            self.locate(robot)
        if end is not None:
            self.post(transport.GoalEnded(robot, goal.number, ENDS[end], ""))

    def cancel(self, robot: str) -> None:
        self.cancelled.append(robot)
        if self.script and self.script[0][0] == "canceled":
            self.script.pop(0)
            self.post(transport.GoalEnded(robot, self.goals[-1].number, transport.GoalEnd.CANCELED))

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        assert (action, obstacle) == ("push", "door@9")
        result, text = self.results.pop(0)
        self.post(transport.Performed(robot, number, result, text))

    def close(self) -> None:
        self.closed = True


GIVEN: dict[str, Any] = {"speed": 10.0, "act": {"push": "push"}}


def started(side: float = 1.0, **station: Any) -> tuple[FleetWorld, Robots, Any]:
    scenario = load_scenario_text(SCENARIO.format(resolution=side), "hall.yaml")
    robots = Robots(side)
    stations = {name: Station(f"/{name}", **GIVEN | station) for name in ("digit", "quad")}
    world = FleetWorld(scenario, stations, robots, robots.clock)
    world.open()
    for name in robots.x if "scan" in station else ():
        scanned(robots, name, 9.0)
    return world, robots, scenario


def set_out(
    script: Sequence[tuple[str | None, float | None]], command: int = 1, **station: Any
) -> tuple[FleetWorld, Robots, Any]:
    """The same where digit has been sent to the east, and will do what a script says."""
    world, robots, scenario = started(**station)
    robots.script = list(script)
    world.start(scenario.robots[0], EAST, command)
    return world, robots, scenario


def told(event: WorldEvent) -> tuple[Any, ...]:
    """An event without its time and command."""
    hidden = ("at", "command", "robot", "obstacle", "reason")
    fields = [getattr(event, name) for name in event.__struct_fields__ if name not in hidden]
    return (type(event).__name__, *fields)


EAST = Pose(9, Heading.EAST)
HOME = Pose(8, Heading.EAST)


def seen(world: FleetWorld, robots: Robots, scenario: Scenario) -> Obstacle:
    """A door in region 9, which the quadcopter has reported."""
    robots.post(transport.Reported("quad", "door@9"))
    world.wait(0.05)
    door = world.sense(scenario.robots[0], 9)
    assert door is not None
    return door


def rays(metres: float, ahead: int) -> list[float]:
    """A lidar of four rays, forward, left, back, right: one of them hits something."""
    return [metres if index == ahead else math.inf for index in range(4)]


def scanned(robots: Robots, name: str, metres: float, ahead: int = 0) -> None:
    """A scan where the robot stands, and odometry from after it."""
    robots.stamp += 1.0
    robots.post(transport.Scanned(name, robots.stamp, 0.0, math.pi / 2, rays(metres, ahead)))
    robots.locate(name)
