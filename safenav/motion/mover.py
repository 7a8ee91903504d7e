"""The interface of every kind of motion: how one robot moves, acts, halts and rests.

A mover owns its robot's position and time. The timing decides when the robot moves; the mover
decides how, and how long it takes. The robot never leaves its region, except by a move to the next
one. Each kind is in a module that is loaded on first use.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from importlib import import_module

from msgspec import Struct

from safenav.errors import UsageError
from safenav.motion.file.records import Moving
from safenav.motion.geometry import MetricFloor
from safenav.scenario.motion import installed_kind, known_kinds, parameters


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


class Mover(ABC):
    """A robot in motion. ``time`` is the end of its motion so far, in seconds.

    A kind of motion is a subclass, constructed with the robot's name, the floor, the region and
    the heading (or None) where it starts, its size (metres), and the values of its
    parameters by name (safenav.scenario.motion).
    """

    time: float = 0.0

    def __init__(
        self,
        robot: str,
        floor: MetricFloor,
        region: int,
        heading: str | None,
        size: float,
        values: Mapping[str, float],
    ) -> None:
        self.robot = robot
        self.floor = floor
        self.region = region
        self.heading = heading
        self.size = size
        self.values = values
        self.begin()

    def begin(self) -> None:  # noqa: B027 - a kind that needs nothing more has nothing to do
        """Take up the first pose. Raises UsageError if the robot cannot move so on this floor."""

    @abstractmethod
    def move(self, crossing: Crossing) -> list[Moving]:
        """Carry out a move that begins now."""

    @abstractmethod
    def rest(self, tick: int, until: float) -> list[Moving]:
        """Stay at rest until then."""

    def halt(self, tick: int) -> list[Moving]:
        """Come to rest within the region."""
        del tick
        return []

    def face(self, tick: int, region: int) -> list[Moving]:
        """Turn towards a neighbouring region, to act on it; for its own region, do not turn."""
        del tick, region
        return []

    def resume(self, tick: int) -> list[Moving]:
        """Continue to the robot's usual place of rest, after an action short of it."""
        del tick
        return []

    @abstractmethod
    def limits(self) -> Mapping[str, float]:
        """Its limits, for the header of the motion: at least ``size`` in metres."""


_BUILT_IN = {
    "walker": ("safenav.motion.walker.mover", "WalkerMover"),
    "flyer": ("safenav.motion.disc", "FlyerMover"),
    "rover": ("safenav.motion.rover", "RoverMover"),
    "disc": ("safenav.motion.disc", "DiscMover"),
}


def mover(
    robot: str, floor: MetricFloor, region: int, heading: str | None, motion: dict[str, object]
) -> Mover:
    """The mover of a robot by its ``motion`` in a trace (kind and parameters).

    Raises UsageError for an unknown kind, a missing or impossible parameter.
    """
    kind = str(motion.get("kind"))
    known = parameters(kind)
    if known is None:
        raise UsageError(
            f"{robot}: unknown kind of motion '{kind[:40]}'\n    known: {', '.join(known_kinds())}"
        )
    values = {name: parameter.default for name, parameter in known.items()}
    for name, parameter in known.items():
        value = motion.get(name, parameter.default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(f"{robot}: '{name}' of its motion is not a number")
        if not parameter.least <= value <= parameter.most:
            limits = f"from {parameter.least:g} to {parameter.most:g}"
            raise UsageError(f"{robot}: '{name}' of its motion is {value:g}, not {limits}")
        values[name] = float(value)
    found = _class(kind)
    size = values.get("size", 0.5)
    return found(robot, floor, region, heading, size, values)


def _class(kind: str) -> type[Mover]:
    if kind in _BUILT_IN:
        module, name = _BUILT_IN[kind]
        found = getattr(import_module(module), name)
    else:
        found = installed_kind(kind)
    assert isinstance(found, type) and issubclass(found, Mover), f"{kind} is not a Mover"
    return found
