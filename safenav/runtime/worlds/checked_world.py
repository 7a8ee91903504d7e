"""A blocking world of another program; each result is checked before it is used."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Any, TypeVar

from safenav.errors import ExitCode, SafenavError
from safenav.runtime.worlds.protocol import BlockingWorld
from safenav.runtime.worlds.world import Change, ChangingWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.world.map import Region
from safenav.world.moves import Mobility, Pose

T = TypeVar("T")


class WorldError(SafenavError):
    """A world has answered what cannot be, or has failed. Names the call."""

    exit_code = ExitCode.INTERNAL


class CheckedWorld:
    """Queries a world, and raises WorldError for impossible results. ``regions``: of the robots."""

    def __init__(self, world: BlockingWorld, scenario: Scenario) -> None:
        self._world = world
        self._scenario = scenario
        self.regions = {robot.name: robot.start.region for robot in scenario.robots}

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """The obstacle in ``region``, checked to be there."""
        call = f"sense({robot.name!r}, {region})"
        found = self._asked(call, lambda: self._world.sense(robot, region))
        if found is None:
            return None
        obstacle = self._obstacle(call, found)
        if obstacle.region != region:
            raise self._wrong(call, f"{obstacle.name} is not in the requested region")
        return obstacle

    def move(self, robot: Robot, pose: Pose) -> Pose:
        """Move a robot; where it is afterwards."""
        call = f"move({robot.name!r}, {pose.region})"
        found = self._asked(call, lambda: self._world.move(robot, pose))
        if found is None:
            found = pose
        if not isinstance(found, Pose):
            raise self._wrong(call, f"it returned {found!r}, which is neither a pose nor None")
        if not self._scenario.map.is_free(found.region):
            raise self._wrong(call, f"region {found.region} is a wall or off the map")
        if (found.heading is None) != (robot.model.mobility is Mobility.FREE):
            raise self._wrong(call, f"{robot.name} is a robot of {robot.model.mobility} mobility")
        self.regions[robot.name] = found.region
        return found

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        """Return the obstacles that the robot has resolved, each checked to be one that it can."""
        call = f"act({robot.name!r})"
        found = self._asked(call, lambda: list(self._world.act(robot)))
        return [self._resolved(call, robot, entry) for entry in found]

    def changes(self, tick: int, occupied: Collection[Region]) -> list[Change]:
        """Return the obstacles that appeared or disappeared; none in a world without changes."""
        world = self._world
        if not isinstance(world, ChangingWorld):
            return []
        call = f"changes({tick})"
        found: Iterable[Any] = self._asked(call, lambda: list(world.changes(tick, occupied)))
        changes = []
        for change in found:
            if not isinstance(change, Change):
                raise self._wrong(call, f"it returned {change!r}, which is not a Change")
            obstacle = self._obstacle(call, change.obstacle)
            if change.appeared and obstacle.region in occupied and not obstacle.ordered:
                raise self._wrong(call, f"{obstacle.name} appears where a robot is")
            changes.append(change)
        return changes

    def _resolved(self, call: str, robot: Robot, entry: Any) -> tuple[Obstacle, bool | None]:
        if not isinstance(entry, tuple) or len(entry) != 2:
            raise self._wrong(call, f"{entry!r} is not a pair of an obstacle and its truth")
        obstacle, truth = self._obstacle(call, entry[0]), entry[1]
        if truth is not None and not isinstance(truth, bool):
            raise self._wrong(
                call,
                f"{truth!r} is not true, false or None: whether {obstacle.name} is traversable",
            )
        last = len(obstacle.needs) - 1
        if obstacle.needs[last].action not in robot.capabilities:
            action = obstacle.needs[last].action
            raise self._wrong(call, f"{robot.name} cannot '{action}' {obstacle.name}")
        places = obstacle.resolution_regions(self._scenario.map, last)
        here = self.regions[robot.name]
        if here not in places:
            where = ", ".join(map(str, places)) or "nowhere"
            raise self._wrong(
                call, f"{robot.name} is at {here}; {obstacle.name} can be resolved at {where}"
            )
        return obstacle, truth

    def _obstacle(self, call: str, found: Any) -> Obstacle:
        if not isinstance(found, Obstacle):
            raise self._wrong(call, f"{found!r} is not an Obstacle")
        if not self._scenario.map.is_free(found.region):
            raise self._wrong(call, f"{found.name} is in a wall or off the map")
        return found

    def _asked(self, call: str, ask: Callable[[], T]) -> T:
        try:
            return ask()
        except SafenavError:
            raise
        except Exception as error:
            raise WorldError(f"World.{call} failed: {type(error).__name__}: {error}") from error

    def _wrong(self, call: str, found: str) -> WorldError:
        return WorldError(f"World.{call}: {found}")
