"""The interface of a robot in motion: how it moves, acts, halts and rests.

A mover owns its robot's position and time. The timing decides when the robot moves; the mover
decides how, and how long it takes. The robot never leaves its region, except by a move to the next
one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

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


class Mover(Protocol):
    """A robot in motion. ``time`` is the end of its motion so far, in seconds; ``values``: the
    parameters of its motion by name (safenav.scenario.motion)."""

    robot: str
    floor: MetricFloor
    region: int
    heading: str | None
    values: Mapping[str, float]
    time: float

    def move(self, crossing: Crossing) -> list[Moving]:
        """Carry out a move that begins now."""

    def rest(self, tick: int, until: float) -> list[Moving]:
        """Stay at rest until then."""

    def halt(self, tick: int) -> list[Moving]:
        """Come to rest within the region."""

    def face(self, tick: int, region: int) -> list[Moving]:
        """Turn towards a neighbouring region, to act on it; for its own region, do not turn."""

    def resume(self, tick: int) -> list[Moving]:
        """Continue to the robot's usual place of rest, after an action short of it."""

    def limits(self) -> Mapping[str, float]:
        """Its parameters and limits, for the header of the motion."""
