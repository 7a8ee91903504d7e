"""The commands of a run to a blocking world, in ticks, and the checks of its results."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeVar

from safenav.errors import ExitCode, SafenavError
from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.simulation import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region, RegionMap
from safenav.world.poses import Mobility, Pose

T = TypeVar("T")


class WorldError(SafenavError):
    """A world returned an impossible value, or failed. The message names the call."""

    exit_code = ExitCode.INTERNAL


def asked(call: str, ask: Callable[[], T]) -> T:
    """Return the result of a call to a world. Raises WorldError if the call fails."""
    try:
        return ask()
    except Exception as error:
        raise WorldError(f"World.{call} failed: {type(error).__name__}: {error}") from error


def inputs_of(world: object, tick: int) -> dict[str, bool]:
    """Return the inputs that a world sets in a tick. Raises WorldError, also for a value such as
    "off"."""
    inputs = protocol.optional(world, "inputs")

    def read() -> dict[str, bool]:
        values = {} if inputs is None else inputs(tick)
        for name, value in values.items():
            if value not in (False, True):
                raise ValueError(f"{name} is {value!r}, not True or False")
        return {name: bool(value) for name, value in values.items()}

    return asked(f"inputs({tick})", read)


class Lockstep:
    """The commands of a run to a blocking world: each has ended when it returns, except steps of
    several ticks, which only a simulation makes when they end. Raises WorldError for impossible
    results."""

    live = simulated = pauses = idle = False
    zero = 0.0

    def __init__(self, world: protocol.BlockingWorld, scenario: Scenario) -> None:
        self._world, self._scenario, self._tick = world, scenario, 0
        self._simulated = world if isinstance(world, SimulatedWorld) else None
        self._changes = protocol.optional(world, "changes")
        self._ended: dict[str, protocol.Ended] = {}

    def resume(self, time: float, poses: Mapping[str, Pose], last: int) -> None:
        """Continue after a tick."""
        del poses, last
        self._tick = int(time)

    def times(self) -> Sequence[float]:
        """Return the ticks at which a simulation changes something."""
        return [] if self._simulated is None else [float(t) for t in self._simulated.times()]

    def now(self) -> float:
        return float(self._tick)

    def number(self, name: str) -> int:
        """Return 0: commands have no numbers."""
        del name
        return 0

    def expected(self, robot: Robot) -> float | None:
        """Return None: steps have no duration in seconds."""

    def hear(self, due: float | None, changed: bool) -> bool:
        """Begin the next tick."""
        del due, changed
        self._tick += 1
        return True

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return the obstacle in ``region``, according to the world's sensors. Raises
        WorldError."""
        return sensed(self._world, robot, region, self._scenario.map)

    def start(self, robot: Robot, here: Pose, pose: Pose) -> protocol.Ended | None:
        """Send a robot to ``pose``; return the end of its step, if it has already ended."""
        if pose.region == here.region or robot.model.timing == 1:
            return self._moved(robot, pose)
        if self._simulated is None:
            self._ended[robot.name] = self._moved(robot, pose)
        return None

    def ended(self, robot: Robot, to: Pose) -> protocol.Ended:
        """Return the end of a robot's step of several ticks, in its turn when it is due."""
        return self._ended.pop(robot.name, None) or self._moved(robot, to)

    def act(self, robot: Robot, here: Pose, obstacles: Sequence[Obstacle]) -> protocol.Acted:
        """Return the obstacles that the robot has resolved, each checked to be one that it can."""
        if self._simulated is not None:  # other worlds resolve all that the robot can
            self._simulated.cleared = {obstacle.name for obstacle in obstacles}
        call = f"act({robot.name!r})"
        entries = asked(call, lambda: list(self._world.act(robot)))
        results = [self._resolved(call, robot, here.region, entry) for entry in entries]
        found = tuple(
            (obstacle, ActResult.UNTRAVERSABLE if truth is False else ActResult.DONE)
            for obstacle, truth in results
        )
        return protocol.Acted(self.now(), robot.name, found)

    def acted(self, robot: Robot) -> protocol.Acted | None:
        """Return None: no action is under way."""

    def changes(self, occupied: Collection[Region]) -> list[protocol.Change]:
        """Return the obstacles that appeared or disappeared; none in a world without changes."""
        listed, tick = self._changes, self._tick
        if listed is None:
            return []
        call = f"changes({tick})"
        changes = []
        for each in asked(call, lambda: list(listed(tick, occupied))):
            change = _part(call, each, protocol.Change)
            obstacle = checked(call, change.obstacle, self._scenario.map)
            if change.appeared and obstacle.region in occupied and not obstacle.ordered:
                raise wrong(call, f"{obstacle.name} appears where a robot is")
            changes.append(change)
        return changes

    def _moved(self, robot: Robot, pose: Pose) -> protocol.Ended:
        """Return the end of a step, with the pose that the world reports, checked to be
        possible."""
        call = f"move({robot.name!r}, {pose.region})"
        found = asked(call, lambda: self._world.move(robot, pose))
        found = pose if found is None else found
        found = _part(call, found, Pose)
        if not self._scenario.map.is_free(found.region):
            raise wrong(call, f"region {found.region} is a wall or off the map")
        if (found.heading is None) != (robot.model.mobility is Mobility.FREE):
            raise wrong(call, f"{robot.name} is a robot of {robot.model.mobility} mobility")
        if found == pose:
            return protocol.Arrived(self.now(), robot.name)
        return protocol.Elsewhere(self.now(), robot.name, found)

    def _resolved(
        self, call: str, robot: Robot, here: Region, entry: Any
    ) -> tuple[Obstacle, bool | None]:
        named, truth = _part(call, entry, tuple[Obstacle, bool | None])
        obstacle = checked(call, named, self._scenario.map)
        last = len(obstacle.needs) - 1
        if obstacle.needs[last].action not in robot.capabilities:
            action = obstacle.needs[last].action
            raise wrong(call, f"{robot.name} cannot '{action}' {obstacle.name}")
        places = obstacle.resolution_regions(self._scenario.map, last)
        if here not in places:
            where = ", ".join(map(str, places)) or "nowhere"
            raise wrong(
                call, f"{robot.name} is at {here}; {obstacle.name} can be resolved at {where}"
            )
        return obstacle, truth


def sensed(
    world: protocol.BlockingWorld | protocol.World, robot: Robot, region: Region, floor: RegionMap
) -> Obstacle | None:
    """Return the obstacle in ``region``, according to a world's sensors. Raises WorldError."""
    call = f"sense({robot.name!r}, {region})"
    found = asked(call, lambda: world.sense(robot, region))
    if found is not None and checked(call, found, floor).region != region:
        raise wrong(call, f"{found.name} is not in the requested region")
    return found


def checked(call: str, found: Any, world: RegionMap) -> Obstacle:
    """Return an obstacle that a call returned. Raises WorldError if it cannot be one."""
    if not isinstance(found, Obstacle):
        raise wrong(call, f"{found!r} is not an Obstacle")
    try:
        obstacle = protocol.checked_obstacle(found)
    except ValueError as error:
        raise wrong(call, str(error)) from error
    if not world.is_free(obstacle.region):
        raise wrong(call, f"{obstacle.name} is in a wall or off the map")
    return obstacle


def _part(call: str, found: Any, kind: Any) -> Any:
    """Return the result of a call converted to a type. Raises WorldError if that is impossible."""
    try:
        return protocol.fitted(found, kind)
    except ValueError as error:
        raise wrong(call, f"it returned {found!r}, which {error}") from error


def wrong(call: str, found: str) -> WorldError:
    return WorldError(f"World.{call}: {found}")
