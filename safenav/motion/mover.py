"""A robot in motion: how it moves, acts, halts and rests.

A mover owns its robot's position and time. The timing decides when the robot moves; the mover
decides how, and how long it takes. The robot never leaves its region, except by a move to the next
one.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.motion.file.records import Moving
from safenav.motion.geometry import MetricFloor


class Crossing(Struct, frozen=True):
    """A move between two regions that lie side by side.

    ``heading``: after it; ``short``: an obstacle stands across the middle of ``to``, and the robot
    is to resolve it there, so it stays in the first half of the region.
    """

    tick: int
    origin: int
    to: int
    heading: str
    short: bool = False


class Mover:
    """A robot in motion. ``time`` is the end of its motion so far, in seconds; ``values``: the
    parameters of its motion by name (safenav.scenario.motion)."""

    def __init__(
        self,
        robot: str,
        floor: MetricFloor,
        region: int,
        heading: str | None,
        values: Mapping[str, float],
    ) -> None:
        self.robot, self.floor, self.region, self.heading = robot, floor, region, heading
        self.values, self.time = values, 0.0

    def move(self, crossing: Crossing) -> list[Moving]:
        """Carry out a move that begins now."""
        raise NotImplementedError

    def rest(self, tick: int, until: float) -> list[Moving]:
        """Stay at rest until then."""
        raise NotImplementedError

    def halt(self, tick: int) -> list[Moving]:  # noqa: ARG002
        """Come to rest within the region."""
        return []

    def face(self, tick: int, region: int) -> list[Moving]:  # noqa: ARG002
        """Turn towards a neighbouring region, to act on it; for its own region, do not turn."""
        return []

    def resume(self, tick: int) -> list[Moving]:  # noqa: ARG002
        """Continue to the robot's usual place of rest, after an action short of it."""
        return []

    def limits(self) -> Mapping[str, float]:
        """Its parameters and limits, for the header of the motion."""
        return self.values
