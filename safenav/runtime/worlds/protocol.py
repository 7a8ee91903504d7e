"""The protocols of the actual world: commands that return immediately and events that end them, or
three blocking methods. Reports are checked, since a world may report anything.

Until an event ends a command to move, the robot occupies its departure region and its destination.
So events must be true, and sent after the robot has left all regions that they do not name
(docs/library.md).
"""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from math import isfinite
from numbers import Real
from typing import Any, Protocol, TypeVar, get_origin

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import ExitCode, SafenavError
from safenav.scenario.model import Obstacle, Robot
from safenav.trace.fields import WrongError, convert, plain
from safenav.trace.vocabulary import ActResult
from safenav.trace.words import listed
from safenav.world.map import Region, RegionMap
from safenav.world.poses import Mobility, Pose

T = TypeVar("T")


class DatedEvent(Struct, frozen=True):
    """An event with a time ``at``, in seconds on the world's clock."""

    at: float


class WorldEvent(DatedEvent, frozen=True, kw_only=True):
    """An event that a world reports. ``command``: the number of the command that it ends (None: it
    ends none)."""

    command: int | None = None


class Arrived(WorldEvent, frozen=True):
    """The robot is in the commanded pose and in no other region. ``reason``: the reason for more
    than one attempt."""

    robot: str
    reason: str = ""


class Elsewhere(WorldEvent, frozen=True):
    """The robot is in ``pose``, not in the commanded pose, and in no other region."""

    robot: str
    pose: Pose


class Blocked(WorldEvent, frozen=True):
    """The robot is back in ``pose``, where it departed, and in no other region. It has encountered
    an obstacle (None: an unknown one) in the commanded region."""

    robot: str
    pose: Pose
    obstacle: Obstacle | None = None


class Failed(WorldEvent, frozen=True):
    """The robot is in ``pose`` and in no other region. ``fatal``: whether it can no longer move."""

    robot: str
    pose: Pose
    reason: str
    fatal: bool = False


class Lost(WorldEvent, frozen=True):
    """The robot is in one of ``regions``; which one is unknown."""

    robot: str
    regions: frozenset[Region]
    reason: str = ""


class Sensed(WorldEvent, frozen=True):
    """The robot ``by`` (None: another sensor) has detected an obstacle or, if ``there`` is false,
    that an obstacle is absent."""

    obstacle: Obstacle
    by: str | None = None
    there: bool = True


class Acted(WorldEvent, frozen=True):
    """The action of a robot has ended. It has a result for each obstacle of the command, and for
    each other obstacle that it has resolved; ``done`` means that the obstacle's last need is
    fulfilled. ``reason``: the reason for a failure or no effect."""

    robot: str
    found: Sequence[tuple[Obstacle, ActResult]] = ()
    reason: str = ""


Ended = Arrived | Elsewhere | Blocked | Failed | Lost
"""Events that end a step."""


class World(Protocol):
    """The actual world of a live run. Only ``wait`` may block. Commands have increasing numbers.
    One event with its number ends each command. If it has already happened, ``start`` and ``act``
    return it (else None); otherwise ``wait`` does. Results are checked; an event that cannot be
    true counts as a lost robot or a failed action."""

    def now(self) -> float:
        """Return the present second on a monotonic clock."""

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return the unresolved obstacle that the newest reading shows in ``region``, which
        ``robot`` is about to enter; None if there is none."""

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        """Send the robot to ``pose``, in a neighbouring region."""

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> WorldEvent | None:
        """Let the robot act in its region, on ``obstacles``, which the team knows, and on others.
        The action always ends with ``Acted``; its result for an absent obstacle is ``nothing``."""

    def cancel(self, robot: Robot) -> None:
        """Stop the robot as soon as possible; the command still ends with its event."""

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        """Wait for events, at most ``timeout`` seconds (None: no limit), and return them."""


class BlockingWorld(Protocol):
    """The actual world of a lockstep run: implement these three methods to drive real robots.

    Results are checked; an exception ends the run with a typed error.
    """

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return the unresolved obstacle in a region that ``robot`` is about to enter, or None."""

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        """Bring the robot to ``pose``, in a neighbouring region. Return the reached pose, or None
        if that is the commanded one."""

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        """Let a robot with capabilities act in its region: at its start, after each ``move``, and
        while it can act on a known obstacle. Return each obstacle whose last need this fulfils, and
        whether its region is traversable (None: its type has no truth).

        The mission derives earlier needs from the poses of the robots."""


def optional(world: object, name: str, without: object = None) -> Callable[..., Any]:
    """Return a method that a world need not have; one with the result ``without`` if it has none:

    - ``changes(tick, occupied)``: each ``Change`` by the beginning of a tick; nothing may appear in
      the ``occupied`` regions, in which robots stand or which they are entering.
    - ``inputs(tick)``: the inputs of a tick by name; those that are missing stay as they are.

    In a live run ``pauses`` (no method) states whether time passes in ``wait`` only, and there are

    - ``expected(robot)`` and ``times()``, of a simulation: the seconds of the robot's last command,
      and the future times at which the world changes by itself. Its time passes in ``wait`` only.
    - ``placed(robot, pose)``: an operator has put a robot without a command there.
    - ``cleared(obstacle)``: an operator has resolved it, so that earlier readings of it are void.
    """
    found: Callable[..., Any] = getattr(world, name, lambda *_: without)
    return found


class Change(Struct, frozen=True):
    """An obstacle that appeared, or disappeared unresolved. ``by_user``: whether a user who watches
    the run caused it. ``truth``: the truth that its resolution reveals, if that differs from the
    truth of the last obstacle of this name."""

    obstacle: Obstacle
    appeared: bool
    by_user: bool = False
    truth: bool | None = None


def is_time(found: Any) -> bool:
    """Return whether a value is a valid time in seconds."""
    try:
        return isinstance(found, (float, Real)) and isfinite(found)
    except OverflowError:  # an int may be too large for a float
        return False


def fitted(found: Any, kind: Any) -> Any:
    """Return a value with all its parts converted to their types. Python checks neither types nor
    bounds, and accepts ``Obstacle("door", 47)``. Raises ValueError."""
    try:
        return convert(kind, plain(found))
    except (WrongError, TypeError) as error:
        raise ValueError(f"is invalid: {error}") from error


def flaw_of(obstacle: Obstacle) -> str | None:
    """Return the reason why an obstacle cannot be part of a scenario; None if it can."""
    needs, where = obstacle.needs, f"the obstacle in region {obstacle.region}"
    if needs[0].same:
        return f"{where} has no previous need for 'same'"
    if any(need.same and need.robots != last.robots for last, need in pairwise(needs)):
        return f"{where} needs as many robots for a 'same' need as for the previous one"
    return None


def well_formed(event: Any, robots: Collection[str]) -> WorldEvent:
    """Return a report with all its parts converted to their types, if it names only known robots.
    Raises ValueError otherwise."""
    if not isinstance(event, WorldEvent):
        raise ValueError(f"{event!r} is not an event")
    if not is_time(event.at):
        raise ValueError(f"its time is {event.at!r}, not seconds")
    if event.command is None and not isinstance(event, Sensed):
        told = "command=, the number passed to start or act"
        raise ValueError(f"the event names no command ({told})")
    try:
        report: WorldEvent = replace(fitted(replace(event, at=0.0), type(event)), at=event.at)
    except ValueError as error:
        raise ValueError(f"it {error}") from error
    for name in (getattr(report, "robot", None), getattr(report, "by", None)):
        if name is not None and name not in robots:
            raise ValueError(f"no robot is named {name!r}")
    obstacles = getattr(report, "obstacle", None), *(o for o, _ in getattr(report, "found", ()))
    if flaw := next(filter(None, (each and flaw_of(each) for each in obstacles)), None):
        raise ValueError(flaw)
    return report


def wrong_step(
    event: WorldEvent, world: RegionMap, robot: Robot, here: Pose, target: Pose
) -> str | None:
    """Return the reason why a well-formed event cannot end a step from ``here`` to ``target``; None
    if it can."""
    match event:
        case Arrived():
            return None
        case Lost(regions=regions):
            if not regions:
                return "the event names no region in which the robot may be"
            wrong = [region for region in regions if not world.is_free(region)]
            if not wrong:
                return None
            where = "a wall" if 0 <= wrong[0] < world.size else "off the map"
            return f"the robot cannot be lost in region {wrong[0]}, {where}"
        case Blocked(pose=pose) if pose.region != here.region:
            return f"blocked, but not back in region {here.region}"
        case Blocked(obstacle=Obstacle(name=name, region=region)) if region != target.region:
            return f"blocked by {name}, which is not in region {target.region}"
        case Elsewhere(pose=pose) | Blocked(pose=pose) | Failed(pose=pose):
            near = {here.region, target.region}
            near |= {r for region in near for r in world.neighbours(region)}
            if pose.region not in near:
                return f"region {pose.region} is not next to the regions of its step"
            if (pose.heading is None) != (robot.model.mobility is Mobility.FREE):
                return f"it is a robot of {robot.model.mobility} mobility"
            return None
    return f"{type(event).__name__} ends no step"


def wrong_result(event: WorldEvent) -> str | None:
    """Return the reason why a well-formed event is not a result of an action; None if it is."""
    if isinstance(event, Acted):
        return None
    if isinstance(event, Failed):
        return event.reason
    return f"{type(event).__name__} ends no action"


# Calls of worlds.


class WorldError(SafenavError):
    """An impossible value from a world, or its failure. The message names the call."""

    exit_code = ExitCode.INTERNAL


def asked(call: str, ask: Callable[[], T]) -> T:
    """Return the result of a call of a world's method. Raises WorldError if the call fails."""
    try:
        return ask()
    except Exception as error:
        raise WorldError(f"World.{call} failed: {type(error).__name__}: {error}") from error


def returned(call: str, ask: Callable[[], Any], kind: Any) -> Any:
    """Return the result of a call converted to its type; any iterable is converted to a list.
    Raises WorldError if the call or the conversion fails."""
    found = asked(call, ask)
    if get_origin(kind) is list and isinstance(found, Iterable):
        found = asked(call, lambda: [*found])
    try:
        return fitted(found, kind)
    except ValueError as error:
        expected = re.sub(r"(\w+\.)+", "", str(kind))
        raise wrong(call, f"it returned {found!r}, which {error}; expected {expected}") from error


def inputs_of(world: object, names: Collection[str], tick: int) -> dict[str, bool]:
    """Return the inputs that a world sets in a tick. Raises WorldError if the call fails, a value
    is not valid (such as "off"), or a name is not among ``names``."""

    def read() -> dict[str, bool]:
        values = optional(world, "inputs", {})(tick)
        if not isinstance(values, Mapping):
            raise TypeError(f"it returned {values!r}, not values of inputs by name")
        if unknown := values.keys() - {*names}:
            raise ValueError(f"no input is named {listed(sorted(map(repr, unknown)))}")
        for name, value in values.items():
            if value not in (False, True):
                raise ValueError(f"{name} is {value!r}, not True or False")
        return {name: bool(value) for name, value in values.items()}

    return asked(f"inputs({tick})", read)


def changes_of(
    world: object, tick: int, occupied: Collection[Region], floor: RegionMap
) -> list[Change]:
    """Return the obstacles that have appeared or disappeared by a tick. Raises WorldError."""
    call, changes = f"changes({tick})", optional(world, "changes", ())
    found: list[Change] = returned(call, lambda: changes(tick, occupied), list[Change])
    for change in found:
        obstacle = checked(call, change.obstacle, floor)
        if change.appeared and obstacle.region in occupied and not obstacle.ordered:
            raise wrong(call, f"{obstacle.name} appears where a robot is")
    return found


def sensed(
    world: BlockingWorld | World, robot: Robot, region: Region, floor: RegionMap
) -> Obstacle | None:
    """Return the obstacle that a world's sensors show in ``region``; None if there is none. Raises
    WorldError."""
    call = f"sense({robot.name!r}, {region})"
    found: Obstacle | None = returned(call, lambda: world.sense(robot, region), Obstacle | None)
    if found is not None and checked(call, found, floor).region != region:
        raise wrong(call, f"{found.name} is not in the requested region")
    return found


def checked(call: str, obstacle: Obstacle, world: RegionMap) -> Obstacle:
    """Return an obstacle that a call returned. Raises WorldError if it cannot exist."""
    flaw = flaw_of(obstacle)
    if flaw is None and not world.is_free(obstacle.region):
        flaw = f"{obstacle.name} is in a wall or off the map"
    if flaw is not None:
        raise wrong(call, flaw)
    return obstacle


def wrong(call: str, found: str) -> WorldError:
    return WorldError(f"World.{call}: {found}")
