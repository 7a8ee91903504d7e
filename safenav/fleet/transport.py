"""The interface between fleet and middleware: goals in metres out, messages in.

The fleet (``safenav.fleet.world``) handles regions, poses, time limits and retries; a transport
handles only one middleware. Positions are in metres in the frame of the scenario's map, angles in
radians, counter-clockwise from east. A transport may deliver messages from any thread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from math import atan2, floor, hypot, pi
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

from safenav.pace.robot import YAW
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Frame, Heading, Region, RegionMap
from safenav.world.poses import Pose

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints as Setpoints


class Places(Struct, frozen=True):
    """The regions of a map in metres."""

    world: RegionMap
    frame: Frame

    def centre(self, region: Region) -> tuple[float, float]:
        """Return x and y of a region's centre."""
        return self.frame.centre(*self.world.position(region), self.world.rows)

    def yaw(self, pose: Pose) -> float | None:
        """Return the direction of a robot; None for a robot without a heading."""
        return None if pose.heading is None else YAW[pose.heading.label] + self.frame.yaw

    def region(self, x: float, y: float) -> Region | None:
        """Return the region that contains a point; None off the map."""
        east, north = self.frame.on_map(x, y)
        col = floor(east / self.frame.resolution)
        row = self.world.rows - 1 - floor(north / self.frame.resolution)
        inside = 0 <= row < self.world.rows and 0 <= col < self.world.cols
        return self.world.region(row, col) if inside else None

    def heading(self, yaw: float) -> Heading:
        """Return the heading nearest to a direction."""
        facing = yaw - self.frame.yaw
        return min(Heading, key=lambda heading: abs(turned(YAW[heading.label] - facing)))

    def distance(self, region: Region, x: float, y: float) -> float:
        """Return the distance in metres from a point to the centre of a region."""
        cx, cy = self.centre(region)
        return hypot(cx - x, cy - y)

    def outside(self, region: Region, x: float, y: float) -> float:
        """Return the distance in metres from a point to a region; 0 inside it."""
        east, north = self.frame.on_map(x, y)
        at = self.frame.on_map(*self.centre(region))
        half = self.frame.resolution / 2
        return hypot(max(0.0, abs(east - at[0]) - half), max(0.0, abs(north - at[1]) - half))

    def bearing(self, region: Region, x: float, y: float) -> float:
        """Return the direction from a point to the centre of a region."""
        cx, cy = self.centre(region)
        return atan2(cy - y, cx - x)


def turned(angle: float) -> float:
    """Return an angle normalized to -pi to pi."""
    return (angle + pi) % (2 * pi) - pi


class GoalEnd(StrEnum):
    """The end of a goal."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"
    REJECTED = "rejected"
    UNREACHABLE = "unreachable"  # no server replies


class GoalPoint(Struct, frozen=True):
    """A robot's destination. ``yaw``: None for a robot without a heading. ``number``: identifies
    the goal uniquely in a run. ``short``: whether the region contains an obstacle that the robot
    resolves from inside."""

    number: int
    x: float
    y: float
    yaw: float | None
    short: bool = False


class GoalEnded(Struct, frozen=True):
    robot: str
    number: int
    end: GoalEnd
    reason: str = ""


class Performed(Struct, frozen=True):
    """The result of an action."""

    robot: str
    number: int
    result: ActResult
    reason: str = ""


class Located(Struct, frozen=True):
    """Odometry. ``stamp``: seconds of the robot's clock, compared only with stamps of the same
    robot."""

    robot: str
    stamp: float
    x: float
    y: float
    yaw: float


class Scanned(Struct, frozen=True):
    """A lidar's rays, ``ranges[i]`` metres at angle ``first + i * step`` from the robot's front. A
    range is infinite without a hit, NaN without a reading."""

    robot: str
    stamp: float
    first: float
    step: float
    ranges: Sequence[float]


class Reported(Struct, frozen=True):
    """A text report about the present state of an obstacle: ``door@47`` is present, ``-door@47`` is
    gone."""

    robot: str
    text: str


class InputHeard(Struct, frozen=True):
    """The present value of an input of the environment."""

    name: str
    on: bool
    robot: str = ""


Message = InputHeard | GoalEnded | Performed | Located | Scanned | Reported


class Transport(Protocol):
    """A middleware. Only ``step`` waits for robots."""

    @property
    def step(self) -> Callable[[], None] | None:
        """Advance a simulation, where time passes only while the run waits, to its next messages.
        None: time passes by itself."""

    def now(self) -> float:
        """Return the time on the clock of the middleware, in seconds."""

    def open(self, post: Callable[[Message], None]) -> None:
        """Connect. ``post`` takes messages from any thread until ``close`` returns.

        Raises UsageError if the middleware cannot be used."""

    def missing(self) -> list[str]:
        """Return the names of action servers and followers' topics without a robot so far."""

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        """Send a robot to a goal. One GoalEnded message follows for each goal."""

    def cancel(self, robot: str) -> None:
        """Stop a robot as soon as possible, a follower after its step. GoalEnded follows."""

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        """Let a robot act on an obstacle from where it is. One Performed message follows."""

    def close(self) -> None:
        """Cancel every goal and disconnect. A second call does nothing."""


class Streamer(Transport, Protocol):
    """A transport that also streams references."""

    def follow(self, robot: str, reference: Setpoints) -> None:
        """Stream ``Setpoints.ahead`` of a reference 20 times per second until the next one or
        ``close``. No message follows. Its times are on the clock of ``now``. A robot must stop by
        itself when its stream ends."""


def result_of(success: bool, text: str) -> ActResult:
    """Return the result in a service's response (std_srvs/Trigger): its message ``done``,
    ``untraversable``, ``failed`` or ``nothing``. For other messages, ``success`` decides."""
    word = text.strip()
    if word in set(ActResult):
        return ActResult(word)
    return ActResult.DONE if success else ActResult.FAILED
