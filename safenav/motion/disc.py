"""A disc that glides from centre to centre, the default motion of a model; and a quadcopter, which
flies the same way.

Each move is a quintic from rest to rest, so it is independent of the moves that follow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, hypot, pi, remainder, tau

from safenav.errors import UsageError
from safenav.motion.file.records import Curve, Flight, Moving
from safenav.motion.geometry import MetricFloor, unit_vector
from safenav.motion.mover import Crossing, Mover
from safenav.motion.polynomial import PEAK, quintic
from safenav.pace.robot import RESERVE, ROOM, TURNING, YAW, glide


def end_of(crossing: Crossing, floor: MetricFloor, size: float) -> tuple[float, float]:
    """Rest position of a round body of that size: in the centre of the region, or short of an
    obstacle there."""
    x, y = floor.centre(crossing.to)
    if crossing.short:
        ahead, back = unit_vector(crossing.heading), floor.side / 2 - size / 2 - ROOM
        x, y = x - ahead[0] * back, y - ahead[1] * back
    return x, y


class DiscMover(Mover):
    """A disc at rest at ``place``, in the centre of its region or short of it."""

    name = "glide"
    at_rest = "rest"

    def begin(self) -> None:
        side = self.floor.side
        if self.size + 2 * ROOM > side:
            raise UsageError(
                f"{self.robot}: a body of {self.size:g} m does not fit into regions of {side:g} m\n"
                "    give the map a larger 'resolution', or the model a smaller 'size'"
            )
        self.place = self.floor.centre(self.region)
        self.facing = YAW[self.heading] if self.heading else 0.0

    @property
    def altitude(self) -> float:
        """Metres above the ground."""
        return 0.0

    def limits(self) -> Mapping[str, float]:
        return {"size": self.size, "speed": self.values["speed"]}

    def seconds(self, metres: float) -> float:
        """Return the duration of a path from rest to rest."""
        return glide(metres, self.values["speed"])

    def move(self, crossing: Crossing) -> list[Moving]:
        there = end_of(crossing, self.floor, self.size)
        moved = self._go(crossing.tick, there, YAW[crossing.heading], crossing.to)
        self.region, self.heading = crossing.to, crossing.heading
        return moved

    def rest(self, tick: int, until: float) -> list[Moving]:
        x, y = self.place
        still = Curve(until - self.time, (x,), (y,), (self.altitude,), (self.facing,))
        return [self._made(self.at_rest, tick, self.region, [still], until)]

    def face(self, tick: int, region: int) -> list[Moving]:
        if region == self.region:
            return []
        (x, y), (u, v) = self.floor.centre(self.region), self.floor.centre(region)
        return self._turn(tick, atan2(v - y, u - x))

    def resume(self, tick: int) -> list[Moving]:
        centre = self.floor.centre(self.region)
        if self.place == centre:
            return []
        return self._go(tick, centre, self.facing, self.region)

    def turning(self, angle: float) -> float:
        """Return the duration of a turn on the spot."""
        return PEAK * abs(angle) / TURNING

    def _turn(self, tick: int, wanted: float) -> list[Moving]:
        turned = self._curves(self.place, wanted)
        return [self._made("turn", tick, self.region, turned)] if turned else []

    def _go(self, tick: int, there: tuple[float, float], wanted: float, to: int) -> list[Moving]:
        return [self._made(self.name, tick, to, self._curves(there, wanted))]

    def _curves(self, there: tuple[float, float], wanted: float) -> list[Curve]:
        """Return the path to a pose, from rest to rest; none to where the robot is."""
        here = self.place
        metres = hypot(there[0] - here[0], there[1] - here[1])
        angle = remainder(wanted - self.facing, tau)
        if abs(angle) < 1e-9:
            angle = 0.0
        if abs(angle + pi) < 1e-9:
            angle = pi
        if metres == angle == 0.0:
            return []
        seconds = max(self.seconds(metres), self.turning(angle))
        x, y = (quintic(seconds, here[i], 0.0, there[i], 0.0) for i in (0, 1))
        turning = quintic(seconds, self.facing, 0.0, self.facing + angle, 0.0)
        self.place, self.facing = there, wanted
        return [Curve(seconds, x, y, (self.altitude,), turning)]

    def _made(
        self, name: str, tick: int, to: int, parts: Sequence[Curve], until: float | None = None
    ) -> Moving:
        """Return a piece of motion from now on, as long as its parts, or ``until`` a time."""
        begin = self.time
        self.time = begin + sum(part.seconds for part in parts) if until is None else until
        return Flight(self.robot, tick, name, self.region, to, begin, self.time, tuple(parts))


class FlyerMover(DiscMover):
    """A quadcopter that hovers at ``place``, at its altitude."""

    name = "fly"
    at_rest = "hover"

    @property
    def altitude(self) -> float:
        return self.values["altitude"]

    def limits(self) -> Mapping[str, float]:
        own = {"altitude": self.altitude, "tilt": self.values["tilt"]}
        return {**super().limits(), **own}

    def seconds(self, metres: float) -> float:
        return glide(metres, self.values["speed"], RESERVE * self.values["tilt"])
