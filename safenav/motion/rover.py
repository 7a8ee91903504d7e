"""A unicycle: it turns on the spot in the centre of a region and drives straight to the next.

Speed and acceleration, straight and in turning, stay within its limits. Its body is a
disc, which has room to turn in a region.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2

from safenav.motion.disc import DiscMover
from safenav.motion.file.records import Curve, Moving
from safenav.pace.robot import glide


class RoverMover(DiscMover):
    """A rover at rest at ``place``, facing ``facing`` radians."""

    name = "drive"

    def limits(self) -> Mapping[str, float]:
        names = ("speed", "acceleration", "turning")
        return {"size": self.size, **{name: self.values[name] for name in names}}

    def seconds(self, metres: float) -> float:
        return glide(metres, self.values["speed"], self.values["acceleration"])

    def turning(self, angle: float) -> float:
        pull = self.values["acceleration"] / (self.size / 2)
        return glide(abs(angle), self.values["turning"], pull)

    def resume(self, tick: int) -> list[Moving]:
        x, y = self.floor.centre(self.region)
        if self.place == (x, y):
            return []
        ahead = atan2(y - self.place[1], x - self.place[0])
        return self._go(tick, (x, y), ahead, self.region)

    def _curves(self, there: tuple[float, float], wanted: float) -> list[Curve]:
        return [*super()._curves(self.place, wanted), *super()._curves(there, wanted)]
