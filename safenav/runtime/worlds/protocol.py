"""The protocols of the actual world: commands that return immediately, and the events that end
them; or three methods that block.

A robot that was sent somewhere occupies the region that it leaves and the one that it goes to
until an event ends the command. So events must be true, and sent after the robot has left all
regions that they do not name (docs/library.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol, runtime_checkable

from msgspec import Struct

from safenav.scenario.model import Obstacle, Robot
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.moves import Pose


class DatedEvent(Struct, frozen=True):
    """``at``: when it was so, in seconds on the world's clock."""

    at: float


class WorldEvent(DatedEvent, frozen=True, kw_only=True):
    """An event that a world reports. ``command``: the number of the command that it ends; None if
    it ends none."""

    command: int | None = None


class Arrived(WorldEvent, frozen=True):
    """The robot is in the pose that it was sent to, and in no other region. ``reason``: why it took
    more than one attempt."""

    robot: str
    reason: str = ""


class Elsewhere(WorldEvent, frozen=True):
    """The robot is in ``pose`` instead, and in no other region."""

    robot: str
    pose: Pose


class Blocked(WorldEvent, frozen=True):
    """The robot is back in ``pose``, where it set out, and in no other region: it met an obstacle
    (None: it does not know which) in the region that it was sent to."""

    robot: str
    pose: Pose
    obstacle: Obstacle | None = None


class Failed(WorldEvent, frozen=True):
    """The robot is in ``pose`` and in no other region. ``fatal``: it can no longer move."""

    robot: str
    pose: Pose
    reason: str
    fatal: bool = False


class Lost(WorldEvent, frozen=True):
    """The robot is somewhere in ``regions``; nothing else is known of it."""

    robot: str
    regions: frozenset[Region]
    reason: str = ""


class Sensed(WorldEvent, frozen=True):
    """``by`` (None: a sensor outside the robots) has seen an obstacle, or (``there`` false) that
    it has disappeared."""

    obstacle: Obstacle
    by: str | None = None
    there: bool = True


class Acted(WorldEvent, frozen=True):
    """The action of a robot is over: the result for each obstacle that it was to act on, and for
    each other one that it has resolved. ``done``: its last need is met. ``reason``: why it has
    failed, or ended without doing anything."""

    robot: str
    found: Sequence[tuple[Obstacle, ActResult]] = ()
    reason: str = ""


Ended = Arrived | Elsewhere | Blocked | Failed | Lost
"""Events that end a step."""


@runtime_checkable
class World(Protocol):
    """The actual world, in time. Only ``wait`` may block. Commands have increasing numbers; each is
    ended by exactly one event with its number, which ``start`` and ``act`` return if it has
    happened already (else None), and ``wait`` later. Results are checked; an event that cannot be
    true is a fatal failure of its robot."""

    @property
    def idle(self) -> bool:
        """Whether no command is open, so that no event is to come."""

    def now(self) -> float:
        """Seconds since some moment; never less than before."""

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """The unresolved obstacle in a region that ``robot`` is about to enter, if any is known to
        its sensors now."""

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        """Send the robot to ``pose``, in its own region or a neighbouring one."""

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> WorldEvent | None:
        """Let the robot perform its actions where it stands: on ``obstacles``, as far as the team
        knows, and on those that the team does not know. Always ended by ``Acted``, be it with
        ``nothing`` for an obstacle that is not there."""

    def cancel(self, robot: Robot) -> None:
        """Stop the robot's command as soon as possible; it is still ended by its event."""

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        """Wait for events, at most ``timeout`` seconds (None: no limit); those that happened."""


class BlockingWorld(Protocol):
    """The actual world of a run in lockstep: an implementation of these three methods can drive
    real robots.

    Its results are checked; an exception ends the run with a typed error.
    """

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """The unresolved obstacle in a region that ``robot`` is about to enter, if any."""

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        """Bring the robot to ``pose``: its own region or a neighbouring one. Return the pose that
        it really has now, or None if that is the commanded one."""

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        """Let the robot perform its actions where it stands: after each ``move``, of which the
        first one is to stay where it starts. Return the obstacles whose last need that fulfils,
        each with whether its region is traversable (None: its type has no truth).

        Earlier needs are not returned: the mission derives them from where robots are."""


@runtime_checkable
class TimedWorld(Protocol):
    """A simulation: it knows how long commands take, and time passes in ``wait`` only."""

    def expected(self, robot: Robot) -> float | None:
        """Seconds that the last command of a robot takes."""

    def times(self) -> Sequence[float]:
        """The times to come at which something changes by itself."""


@runtime_checkable
class PausingWorld(Protocol):
    """A world that may stand still while the run thinks: a simulated fleet."""

    @property
    def pauses(self) -> bool:
        """Whether time passes in ``wait`` only."""


@runtime_checkable
class PlacingWorld(Protocol):
    """A world that keeps the poses of robots."""

    def placed(self, robot: Robot, pose: Pose) -> None:
        """A robot without a command stands in ``pose`` now."""


@runtime_checkable
class RememberingWorld(Protocol):
    """A world that remembers what its sensors have seen: a fleet."""

    def cleared(self, obstacle: Obstacle) -> None:
        """An operator has resolved ``obstacle``: earlier readings of it are void."""
