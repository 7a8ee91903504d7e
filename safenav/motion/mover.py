"""Robots in motion: moves, actions, halts and rests.

A mover owns its robot's position and time. The timing decides when the robot moves; the mover
decides the motion and its duration. The robot never leaves its region except by a move to the next
one. Discs, rovers and flyers glide along curves, which have a polynomial in time for each axis and
for the yaw.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import pairwise
from math import atan2, hypot, pi, remainder, tau

from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.motion.file import Curve, Flight, Moving
from safenav.motion.geometry import MetricFloor, quintic, unit_vector
from safenav.pace.robot import AT_ONCE, ROOM, YAW, Figures


class Mover(ABC):
    """A robot in motion, initially at rest in a region. ``time``: the end of its motion so far, in
    seconds; ``due``: whether it has acted in its own region and must still move to the centre."""

    def __init__(
        self, robot: str, floor: MetricFloor, region: int, heading: str | None, figures: Figures
    ) -> None:
        self.robot, self.floor, self.figures = robot, floor, figures
        self.kind, self.values = figures.kind, figures.values
        self.region, self.heading, self.time = region, heading, 0.0
        self.due = False
        self.begin()

    @abstractmethod
    def begin(self) -> None:
        """Set the initial pose. Raises UsageError if the robot does not fit or cannot move on the
        floor."""

    @abstractmethod
    def move(self, tick: int, to: int, *, short: bool = False) -> list[Moving]:
        """Begin a move to the adjacent region ``to`` now, and return its pieces. ``short``: whether
        the robot will resolve an obstacle across the centre of ``to``, and so stays in the first
        half of the region."""

    @abstractmethod
    def rest(self, tick: int, until: float) -> list[Moving]:
        """Stay at rest until a time. Return the pieces of motion."""

    def wait(self, tick: int, until: float) -> list[Moving]:
        """Stay at rest until a time unless that has passed."""
        return self.rest(tick, until) if until > self.time + AT_ONCE else []

    def halt(self, tick: int) -> list[Moving]:  # noqa: ARG002
        """Let the robot come to rest within its region. Return the pieces of motion."""
        return []

    def face(self, tick: int, region: int) -> list[Moving]:  # noqa: ARG002
        """Turn to an adjacent region to act on it. Do not turn for the robot's own region."""
        return []

    def resume(self, tick: int) -> list[Moving]:  # noqa: ARG002
        """Move the robot to its usual place of rest after an action short of that place."""
        return []


PRIMITIVES = {"disc": ("glide", "rest"), "rover": ("drive", "rest"), "flyer": ("fly", "hover")}
"""The names of a move and of a rest, by kind."""


class Glider(Mover):
    """A body at rest at ``place``, in the centre of its region or short of it, which faces
    ``facing`` (radians). Each move is a quintic from rest to rest along each axis and in yaw.

    Discs and flyers turn as they move. A rover, a unicycle, first turns on the spot, for which its
    region has room, then drives straight.
    """

    def begin(self) -> None:
        size, side = self.values["size"], self.floor.side
        if size + 2 * ROOM > side:
            needed = f"regions of {size + 2 * ROOM:g} m, not {side:g} m"
            raise UsageError(
                f"{self.robot}: a body of {size:g} m needs {needed}\n"
                "    give the map a larger 'resolution', or the model a smaller 'size'"
            )
        self.place = self.floor.centre(self.region)
        self.facing = YAW[self.heading] if self.heading else 0.0
        self._height = (self.values.get("altitude", 0.0),)

    def move(self, tick: int, to: int, *, short: bool = False) -> list[Moving]:
        heading, (x, y) = self.floor.heading(self.region, to), self.floor.centre(to)
        if short:
            ahead = unit_vector(heading)
            back = self.floor.side / 2 - self.values["size"] / 2 - ROOM
            x, y = x - ahead[0] * back, y - ahead[1] * back
        moved = self._go(tick, (x, y), YAW[heading], to)
        self.region, self.heading = to, heading
        return moved

    def rest(self, tick: int, until: float) -> list[Moving]:
        x, y = self.place
        still = Curve(until - self.time, (x,), (y,), self._height, (self.facing,))
        return [self._made(PRIMITIVES[self.kind][1], tick, self.region, [still], until)]

    def face(self, tick: int, region: int) -> list[Moving]:
        if region == self.region:
            return []
        (x, y), (u, v) = self.floor.centre(self.region), self.floor.centre(region)
        turned = self._curves(self.place, atan2(v - y, u - x))
        return [self._made("turn", tick, self.region, turned)] if turned else []

    def resume(self, tick: int) -> list[Moving]:
        (x, y), centre = self.place, self.floor.centre(self.region)
        if self.place == centre:
            return []
        rover = self.kind == "rover"
        wanted = atan2(centre[1] - y, centre[0] - x) if rover else self.facing
        return self._go(tick, centre, wanted, self.region)

    def _go(self, tick: int, there: tuple[float, float], wanted: float, to: int) -> list[Moving]:
        if self.kind == "rover":
            parts = [*self._curves(self.place, wanted), *self._curves(there, wanted)]
        else:
            parts = self._curves(there, wanted)
        return [self._made(PRIMITIVES[self.kind][0], tick, to, parts)]

    def _curves(self, there: tuple[float, float], wanted: float) -> list[Curve]:
        """Return the path from rest to rest to a pose; no curves if the robot is already there."""
        here = self.place
        metres = hypot(there[0] - here[0], there[1] - here[1])
        angle = remainder(wanted - self.facing, tau)
        if abs(angle) < 1e-9:
            angle = 0.0
        if abs(angle + pi) < 1e-9:
            angle = pi
        if metres == angle == 0.0:
            return []
        seconds = max(self.figures.glide(metres), self.figures.turn(abs(angle)))
        x, y = (quintic(seconds, here[i], 0.0, there[i], 0.0) for i in (0, 1))
        turning = quintic(seconds, self.facing, 0.0, self.facing + angle, 0.0)
        self.place, self.facing = there, wanted
        return [Curve(seconds, x, y, self._height, turning)]

    def _made(
        self, name: str, tick: int, to: int, parts: Sequence[Curve], until: float | None = None
    ) -> Moving:
        """Return a piece of motion from now on, as long as its parts or ``until`` a time."""
        begin = self.time
        self.time = begin + sum(part.seconds for part in parts) if until is None else until
        return Flight(self.robot, tick, name, self.region, to, begin, self.time, tuple(parts))


def flown_through(flights: Sequence[Flight], floor: MetricFloor, size: float) -> list[Flight]:
    """Return the flights of a flyer of ``size`` metres, through the same centres at the same times,
    but without halts between consecutive flights.

    It passes a centre at the lower mean speed of both flights, so both stay below their speed and
    acceleration from rest to rest. At a corner it flies diagonally, slowly enough to keep its body
    in its regions: between two corners to one side, a quintic that ends where it began swings out
    by at most 5/32 of a side.
    """
    width = min(1.0, (floor.side / 2 - size / 2 - ROOM) / (floor.side * 5 / 32))
    found = list(flights)
    speeds = [(0.0, 0.0)] * (len(found) + 1)
    for index, (one, other) in enumerate(pairwise(found), start=1):
        if one.primitive == other.primitive == "fly" and abs(other.t0 - one.t1) < AT_ONCE:
            (a, b), (c, d) = _way(one), _way(other)
            first, second = hypot(a, b), hypot(c, d)
            if first and second:  # if the flyer returns, the two directions cancel out
                speed = min(first / (one.t1 - one.t0), second / (other.t1 - other.t0)) / 2
                speed *= width if abs(a * c + b * d) < AT_ONCE else 1.0
                speeds[index] = (speed * (a / first + c / second), speed * (b / first + d / second))
    for index, flight in enumerate(found):
        start, goal = speeds[index : index + 2]
        if (start, goal) != ((0.0, 0.0), (0.0, 0.0)):
            (curve,) = flight.parts
            x, y = (
                quintic(curve.seconds, path[0], begin, path[0] + way, end)
                for path, way, begin, end in zip(
                    (curve.x, curve.y), _way(flight), start, goal, strict=True
                )
            )
            found[index] = replace(flight, parts=(replace(curve, x=x, y=y),))
    return found


def _way(flight: Flight) -> tuple[float, float]:
    """Return the displacement in metres, along x and y, of a flight with one curve."""
    (curve,) = flight.parts
    x, y = (
        sum(c * curve.seconds**power for power, c in enumerate(path) if power)
        for path in (curve.x, curve.y)
    )
    return x, y
