"""A unicycle: it turns on the spot in the centre of a region and drives straight to the next.

Speed and acceleration, straight and in turning, stay within its limits. Its body is a
disc, which has room to turn in a region.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, hypot, pi, remainder, tau

from safenav.errors import UsageError
from safenav.motion.disc import DiscMover
from safenav.motion.file.records import Arc, Drive, Moving
from safenav.motion.polynomial import quintic
from safenav.pace.robot import ROOM, YAW, glide


class RoverMover(DiscMover):
    """A rover at rest at ``place``, facing ``facing`` radians."""

    def begin(self) -> None:
        self.place = self.floor.centre(self.region)
        self.facing = YAW[self.heading] if self.heading else 0.0
        if self.size + 2 * ROOM > self.floor.side:
            raise UsageError(
                f"{self.robot}: a rover of {self.size:g} m cannot turn in regions of "
                f"{self.floor.side:g} m\n"
                "    give the map a larger 'resolution', or the model a smaller 'size'"
            )

    def limits(self) -> Mapping[str, float]:
        names = ("speed", "acceleration", "turning")
        return {"size": self.size, **{name: self.values[name] for name in names}}

    def rest(self, tick: int, until: float) -> list[Moving]:
        still = Arc(until - self.time, *self.place, self.facing, 0.0, (0.0,))
        return [self._made(Drive, "rest", tick, self.region, [still], until)]

    def resume(self, tick: int) -> list[Moving]:
        x, y = self.floor.centre(self.region)
        if self.place == (x, y):
            return []
        ahead = atan2(y - self.place[1], x - self.place[0])
        return self._go(tick, (x, y), ahead, self.region)

    def _turn(self, tick: int, wanted: float) -> list[Moving]:
        arcs = self._turning(wanted)
        return [self._made(Drive, "turn", tick, self.region, arcs)] if arcs else []

    def _go(self, tick: int, there: tuple[float, float], wanted: float, to: int) -> list[Moving]:
        arcs = [*self._turning(wanted), self._driving(there)]
        return [self._made(Drive, "drive", tick, to, arcs)]

    def _turning(self, wanted: float) -> list[Arc]:
        angle = remainder(wanted - self.facing, tau)
        if abs(angle) < 1e-9:
            return []
        if abs(angle + pi) < 1e-9:
            angle = pi
        speed, pull = self.values["turning"], self.values["acceleration"] / (self.size / 2)
        seconds = glide(abs(angle), speed, pull)
        arc = Arc(seconds, *self.place, self.facing, None, quintic(seconds, 0, 0, angle, 0))
        self.facing = wanted
        return [arc]

    def _driving(self, there: tuple[float, float]) -> Arc:
        metres = hypot(there[0] - self.place[0], there[1] - self.place[1])
        seconds = glide(metres, self.values["speed"], self.values["acceleration"])
        arc = Arc(seconds, *self.place, self.facing, 0.0, quintic(seconds, 0, 0, metres, 0))
        self.place = there
        return arc
