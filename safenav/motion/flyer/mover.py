"""A quadcopter as a mover: it flies from centre to centre, from rest to rest."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt

from safenav.motion.disc import PEAK_ACCELERATION, DiscMover


class FlyerMover(DiscMover):
    """A quadcopter that hovers at ``place``, at its altitude."""

    name = "fly"
    at_rest = "hover"
    reserve = 0.5
    """Share of the tilt limit that a reference may use; the rest is for the wind."""

    @property
    def altitude(self) -> float:
        return self.values["altitude"]

    def limits(self) -> Mapping[str, float]:
        own = {"altitude": self.altitude, "tilt": self.values["tilt"]}
        return {**super().limits(), **own}

    def seconds(self, metres: float) -> float:
        pull = self.reserve * self.values["tilt"]
        return max(super().seconds(metres), sqrt(PEAK_ACCELERATION * metres / pull))
