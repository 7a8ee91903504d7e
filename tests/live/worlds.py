"""A floor as safenav's missions meet it."""

from __future__ import annotations

from typing import Any

from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.world.map import Region
from safenav.world.moves import Heading, Pose


class Serial:
    """A world of blocking calls: everybody else stands still while a robot moves or acts."""

    def __init__(self, scenario: Scenario, floor: Any) -> None:
        self.floor = floor
        self.types = {o.type.name: o.type for o in scenario.obstacles}
        self._commands = 0

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self._obstacle(self.floor.sense(robot.name, region))

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        here, _ = self.floor.where(robot.name)
        if here == pose.region:
            return None
        heading = None if pose.heading is None else pose.heading.label
        self.floor.start(robot.name, pose.region, heading, self._next())
        event = self._event()
        if event["event"] == "arrived":
            return None
        region, told = self.floor.where(robot.name)
        return Pose(region, None if told is None else Heading[told.upper()])

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        event = self.floor.act(robot.name, [], self._next()) or self._event()
        truths = {"done": True, "untraversable": False}
        found = []
        for name, deed in event["found"].items():
            obstacle = self._obstacle(name)
            if obstacle is not None and deed in truths:
                found.append((obstacle, truths[deed] if obstacle.type.has_truth else None))
        return found

    def _event(self) -> dict[str, Any]:
        while not (events := self.floor.wait(None)):
            pass
        return dict(events[0])

    def _next(self) -> int:
        self._commands += 1
        return self._commands

    def _obstacle(self, name: str | None) -> Obstacle | None:
        if name is None:
            return None
        kind, region = name.split("@")
        return Obstacle(self.types[kind], int(region))
