"""A blocking world as one of commands and events: each command has ended when it returns
(lockstep), except steps of several ticks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from safenav.errors import ExitCode, SafenavError
from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.protocol import BlockingWorld
from safenav.runtime.worlds.reports import is_region, misfit
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.runtime.worlds.world import Change, ChangingWorld, InputWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose

T = TypeVar("T")


class WorldError(SafenavError):
    """A world returned an impossible value, or failed. Names the call."""

    exit_code = ExitCode.INTERNAL


def asked(call: str, ask: Callable[[], T]) -> T:
    """Return the result of a call to a world. Raises WorldError if the call fails."""
    try:
        return ask()
    except SafenavError:
        raise
    except Exception as error:
        raise WorldError(f"World.{call} failed: {type(error).__name__}: {error}") from error


def inputs_of(world: InputWorld | None, tick: int) -> dict[str, bool]:
    """The inputs that a world sets in a tick. Raises WorldError, also for a value such as "off"."""

    def read() -> dict[str, bool]:
        values = {} if world is None else world.inputs(tick)
        for name, value in values.items():
            if value not in (False, True):
                raise ValueError(f"{name} is {value!r}, not True or False")
        return {name: bool(value) for name, value in values.items()}

    return asked(f"inputs({tick})", read)


class BlockingAdapter:
    """Lockstep: ``wait`` begins the next tick. Raises WorldError for impossible results."""

    def __init__(self, world: BlockingWorld, scenario: Scenario) -> None:
        self._world = world
        self._scenario = scenario
        self._regions = {robot.name: robot.start.region for robot in scenario.robots}
        self._simulated = world if isinstance(world, SimulatedWorld) else None
        self._changing = world if protocol.implements(world, ChangingWorld) else None
        self._tick = 0
        self._open: dict[str, tuple[int, Robot, Pose, int]] = {}

    def due(self) -> dict[str, int]:
        """The ticks in which steps under way end."""
        return {name: each[0] for name, each in self._open.items()}

    def resume(
        self,
        tick: int,
        poses: Mapping[str, Pose],
        steps: Iterable[tuple[int, Robot, Pose, int]],
    ) -> None:
        """Continue after a tick, with robots in these poses and these steps under way."""
        self._tick = tick
        self._regions = {name: pose.region for name, pose in poses.items()}
        self._open = {step[1].name: step for step in steps}

    def times(self) -> Sequence[float]:
        """The ticks at which a simulation changes something."""
        return [] if self._simulated is None else [float(t) for t in self._simulated.times()]

    def now(self) -> float:
        return float(self._tick)

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self._world.sense(robot, region)

    def start(self, robot: Robot, pose: Pose, command: int) -> protocol.WorldEvent | None:
        ticks = self._duration(robot, pose)
        if ticks == 1:
            return self._moved(robot, pose, command)
        self._open[robot.name] = (self._tick + ticks - 1, robot, pose, command)
        return None

    def ended(self, name: str) -> protocol.Ended | None:
        """Return the end of a robot's step, if it is due. Call in the robot's turn: the world
        receives the step only then."""
        due = self._open.get(name)
        if due is None or self._tick < due[0]:
            return None
        del self._open[name]
        return self._moved(*due[1:])

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> protocol.Acted:
        """The obstacles that the robot has resolved, each checked to be one that it can."""
        if self._simulated is not None:  # other worlds do all that they can
            self._simulated.cleared = {obstacle.name for obstacle in obstacles}
        call = f"act({robot.name!r})"
        entries = asked(call, lambda: list(self._world.act(robot)))
        results = [self._resolved(call, robot, entry) for entry in entries]
        found = tuple(
            (obstacle, ActResult.UNTRAVERSABLE if truth is False else ActResult.DONE)
            for obstacle, truth in results
        )
        return protocol.Acted(self.now(), robot.name, found, command=command)

    def within_reach(self, robot: Robot, cleared: Sequence[Obstacle]) -> bool | None:
        """Whether the robot can act on an obstacle where it stands; None if only acting shows."""
        if self._simulated is None:
            return None
        self._simulated.cleared = {obstacle.name for obstacle in cleared}
        return bool(self._simulated.within_reach(robot))

    def cancel(self, robot: Robot) -> None:
        """Forget a step of several ticks, of which the world receives only the end."""
        self._open.pop(robot.name, None)

    def wait(self, timeout: float | None) -> Sequence[protocol.WorldEvent]:
        del timeout
        self._tick += 1
        return ()

    def changes(self, at: float, occupied: Collection[Region]) -> list[Change]:
        """The obstacles that appeared or disappeared; none in a world without changes."""
        world, tick = self._changing, int(at)
        if world is None:
            return []
        call = f"changes({tick})"
        found: Iterable[Any] = asked(call, lambda: list(world.changes(tick, occupied)))
        changes = []
        for change in found:
            if not isinstance(change, Change):
                raise wrong(call, f"it returned {change!r}, which is not a Change")
            obstacle = checked(call, change.obstacle, self._scenario.map)
            if change.appeared and obstacle.region in occupied and not obstacle.ordered:
                raise wrong(call, f"{obstacle.name} appears where a robot is")
            changes.append(change)
        return changes

    def _duration(self, robot: Robot, target: Pose) -> int:
        """Ticks of a step; staying takes 1."""
        return 1 if target.region == self._regions[robot.name] else robot.model.timing

    def _moved(self, robot: Robot, pose: Pose, command: int) -> protocol.Ended:
        """The end of a step, with the pose that the world reports, checked to be possible."""
        call = f"move({robot.name!r}, {pose.region})"
        found = asked(call, lambda: self._world.move(robot, pose))
        if found is None:
            found = pose
        if not isinstance(found, Pose):
            raise wrong(call, f"it returned {found!r}, which is neither a pose nor None")
        if found == pose:
            found = pose
        if not is_region(found.region):
            raise wrong(call, f"region {found.region!r} is not an int")
        if not self._scenario.map.is_free(found.region):
            raise wrong(call, f"region {found.region} is a wall or off the map")
        if (found.heading is None) != (robot.model.mobility is Mobility.FREE):
            raise wrong(call, f"{robot.name} is a robot of {robot.model.mobility} mobility")
        self._regions[robot.name] = found.region
        if found == pose:
            return protocol.Arrived(self.now(), robot.name, command=command)
        return protocol.Elsewhere(self.now(), robot.name, found, command=command)

    def _resolved(self, call: str, robot: Robot, entry: Any) -> tuple[Obstacle, bool | None]:
        if not isinstance(entry, tuple) or len(entry) != 2:
            raise wrong(call, f"{entry!r} is not a pair of an obstacle and its truth")
        obstacle, truth = checked(call, entry[0], self._scenario.map), entry[1]
        if truth is not None and not isinstance(truth, bool):
            raise wrong(
                call,
                f"{truth!r} is not true, false or None: whether {obstacle.name} is traversable",
            )
        last = len(obstacle.needs) - 1
        if obstacle.needs[last].action not in robot.capabilities:
            action = obstacle.needs[last].action
            raise wrong(call, f"{robot.name} cannot '{action}' {obstacle.name}")
        places = obstacle.resolution_regions(self._scenario.map, last)
        here = self._regions[robot.name]
        if here not in places:
            where = ", ".join(map(str, places)) or "nowhere"
            raise wrong(
                call, f"{robot.name} is at {here}; {obstacle.name} can be resolved at {where}"
            )
        return obstacle, truth


def checked(call: str, found: Any, world: RegionMap) -> Obstacle:
    """Return an obstacle that a call returned. Raises WorldError if it cannot be one."""
    if not isinstance(found, Obstacle):
        raise wrong(call, f"{found!r} is not an Obstacle")
    if not is_region(found.region):
        raise wrong(call, f"region {found.region!r} of an obstacle is not an int")
    if (why := misfit(found)) is not None:
        raise wrong(call, why)
    if not world.is_free(found.region):
        raise wrong(call, f"{found.name} is in a wall or off the map")
    return found


def wrong(call: str, found: str) -> WorldError:
    return WorldError(f"World.{call}: {found}")
