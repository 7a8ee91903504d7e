"""Between the fleet and what drives robots: goals in metres out, messages in.

The fleet (``safenav.fleet.world``) knows regions, poses, time limits and retries; a transport knows
one middleware, and none of that. Positions are in metres in the frame of the scenario's map, angles
in radians, counter-clockwise from east. A transport may deliver messages from any thread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

from safenav.trace.vocabulary import ActResult

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints as Setpoints


class GoalEnd(StrEnum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"
    REJECTED = "rejected"
    UNREACHABLE = "unreachable"  # nobody answers


class GoalPoint(Struct, frozen=True):
    """Where a robot is to go. ``yaw``: None for a robot without a heading. ``number``: of the
    goal, never used twice in a run. ``short``: an obstacle stands there, which it is to resolve
    from inside the region."""

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
    """Odometry. ``stamp``: seconds of the robot's clock, only compared with others of its own."""

    robot: str
    stamp: float
    x: float
    y: float
    yaw: float


class Scanned(Struct, frozen=True):
    """A lidar's rays, ``ranges[i]`` metres at angle ``first + i * step`` from the robot's front.
    A ray that hits nothing is infinite."""

    robot: str
    stamp: float
    first: float
    step: float
    ranges: Sequence[float]


class Reported(Struct, frozen=True):
    """A line of text about an obstacle, as of now: ``door@47`` is there, ``-door@47`` is gone."""

    robot: str
    text: str


class InputHeard(Struct, frozen=True):
    """An input of the environment, as of now."""

    name: str
    on: bool
    robot: str = ""


Message = InputHeard | GoalEnded | Performed | Located | Scanned | Reported


class Transport(Protocol):
    """One middleware. No method waits for a robot."""

    def open(self, post: Callable[[Message], None]) -> None:
        """Connect. ``post`` takes messages from any thread until ``close`` returns.

        Raises FleetError if the middleware cannot be used."""

    def missing(self) -> list[str]:
        """The action servers that nobody has answered for yet, by their names."""

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        """Send a robot on its way; GoalEnded follows, once for each goal."""

    def cancel(self, robot: str) -> None:
        """Stop a robot where it is, as soon as it can; its goal ends by GoalEnded."""

    def follow(self, robot: str, reference: Setpoints) -> None:
        """Stream a reference to a robot that tracks for itself, ``Setpoints.ahead`` 20 times per
        second, until the next one or ``close``; nothing follows. Its times are on the clock of the
        fleet's world. A robot whose stream ends has to stop by itself."""

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        """Let a robot act on an obstacle where it stands; Performed follows, once."""

    def close(self) -> None:
        """Cancel every goal, and disconnect. Safe to call twice."""


def result_of(success: bool, text: str) -> ActResult:
    """The meaning of a service's answer (std_srvs/Trigger): its message may be one of the words
    ``done``, ``untraversable``, ``failed``, ``nothing``; else success decides."""
    said = text.strip()
    if said in set(ActResult):
        return ActResult(said)
    return ActResult.DONE if success else ActResult.FAILED


def ignore(message: Message) -> None:
    """Drop a message: no receiver is connected before ``open`` or after ``close``."""
