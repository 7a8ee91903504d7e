"""A quadcopter as a mover: it flies from centre to centre, from rest to rest."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.motion.disc import DiscMover
from safenav.pace.robot import RESERVE, glide


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
