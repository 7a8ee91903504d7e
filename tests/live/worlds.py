"""Adapters of a floor for safenav's missions: by the protocol of live runs, and by blocking
calls."""

from collections.abc import Sequence
from typing import Any

from safenav.runtime.worlds.protocol import (
    Acted,
    Arrived,
    Blocked,
    Elsewhere,
    Failed,
    Lost,
    WorldEvent,
)
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.moves import Heading, Pose


class HangError(Exception):
    """No command is under way, and the mission waits forever."""


class _Seen:
    """safenav's types for the data of a floor. ``floor``: one, or a ``Wired``."""

    def __init__(self, scenario: Scenario, floor: Any) -> None:
        self.floor = floor
        self.types = {o.type.name: o.type for o in scenario.obstacles}

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self.obstacle(self.floor.sense(robot.name, region))

    def obstacle(self, name: str | None) -> Obstacle | None:
        if name is None:
            return None
        kind, region = name.split("@")
        return Obstacle(self.types[kind], int(region))

    def pose(self, told: Any) -> Pose:
        heading = told["heading"]
        return Pose(told["region"], None if heading is None else Heading[heading.upper()])


class Live(_Seen):
    """The floor by protocol 2. Raises HangError if a mission waits although no event can come."""

    def __init__(self, scenario: Scenario, floor: Any, most_waits: int = 200) -> None:
        super().__init__(scenario, floor)
        self._left = self._most = most_waits

    def now(self) -> float:
        return float(self.floor.now())

    def expected(self, robot: Robot) -> float | None:
        """Nobody knows. (Time passes in ``wait`` only.)"""
        del robot
        return None

    def times(self) -> Sequence[float]:
        return ()

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        heading = None if pose.heading is None else pose.heading.label
        self.floor.start(robot.name, pose.region, heading, command)
        return None

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> WorldEvent | None:
        told = self.floor.act(robot.name, [o.name for o in obstacles], command)
        return None if told is None else self._event(told, obstacles)

    def cancel(self, robot: Robot) -> None:
        self.floor.cancel(robot.name)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        told = self.floor.wait(timeout)
        self._left = self._most if told else self._left - 1
        if not self._left:
            raise HangError
        return [self._event(event) for event in told]

    def _event(self, told: Any, about: Sequence[Obstacle] = ()) -> WorldEvent:
        at, name, number = told["at"], told["robot"], told["command"]
        match told["event"]:
            case "arrived":
                return Arrived(at, name, command=number)
            case "elsewhere":
                return Elsewhere(at, name, self.pose(told), command=number)
            case "blocked":
                found = self.obstacle(told["obstacle"])
                return Blocked(at, name, self.pose(told), found, command=number)
            case "failed":
                why, fatal = "motor off" if told["fatal"] else "no way", told["fatal"]
                return Failed(at, name, self.pose(told), why, fatal, command=number)
            case "lost":
                return Lost(at, name, frozenset(told["within"]), command=number)
            case _:
                known = {o.name: o for o in about}
                found = [
                    (known.get(one) or self.obstacle(one), ActResult(result))
                    for one, result in told["found"].items()
                    if result != "part"
                ]
                return Acted(at, name, [(o, result) for o, result in found if o], command=number)


class Serial(_Seen):
    """A world of blocking calls: all other robots stand still while a robot moves or acts."""

    def __init__(self, scenario: Scenario, floor: Any) -> None:
        super().__init__(scenario, floor)
        self._commands = 0
        self._everything = [obstacle.name for obstacle in scenario.obstacles]

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        here, _ = self.floor.where(robot.name)
        if here == pose.region:
            return None
        heading = None if pose.heading is None else pose.heading.label
        self.floor.start(robot.name, pose.region, heading, self._next())
        if self._event()["event"] == "arrived":
            return None
        region, heading = self.floor.where(robot.name)
        return self.pose({"region": region, "heading": heading})

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        event = self.floor.act(robot.name, self._everything, self._next()) or self._event()
        truths = {"done": True, "untraversable": False}
        found = []
        for name, result in event["found"].items():
            obstacle = self.obstacle(name)
            if obstacle is not None and result in truths:
                found.append((obstacle, truths[result] if obstacle.type.has_truth else None))
        return found

    def _event(self) -> dict[str, Any]:
        while not (events := self.floor.wait(None)):
            pass
        return dict(events[0])

    def _next(self) -> int:
        self._commands += 1
        return self._commands
