"""How a walker walks on regions of a given side: its parameters and its periodic gait."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

from safenav.errors import UsageError
from safenav.motion.pendulum import frequency, period, sway

LEAST_SIDE = 1.5
"""Metres of a region below which the arcs of a turn would cross the walker's own feet."""
LONGEST_STEP = 0.5
FULL_STEP = 0.45
"""Metres of a step at the walker's own speed; shorter ones are slower in proportion."""
LONGEST_ARC = 2


@dataclass(frozen=True)
class Walker:
    """The parameters of a walker, in metres, seconds and metres per second.

    ``foot``: how far each foot is from the centre line; ``speed``: at apex; ``clearance``: of
    the swing foot; ``size``: diameter of the circle that its body fits in, seen from above.
    """

    size: float = 0.6
    speed: float = 0.45
    height: float = 0.8
    foot: float = 0.18
    clearance: float = 0.12


@dataclass(frozen=True)
class Gait:
    """The periodic gait of a walker on regions of one side.

    A straight move takes ``steps`` (even, so that each move ends on the foot it began with) of
    ``length`` metres and ``seconds`` each; at apex it moves at ``speed``, and the mass is
    ``sway`` metres off the centre line, towards the stance foot.
    """

    walker: Walker
    side: float
    steps: int
    length: float
    speed: float
    omega: float
    seconds: float
    sway: float

    def approach(self, spent: int) -> int:
        """Straight steps before the arc of a turn that begins ``spent`` steps inside the
        region: as many as leave an arc of the longest radius (``LONGEST_ARC`` steps)."""
        return max(0, self.steps // 2 - spent - LONGEST_ARC)


def gait_on(side: float, walker: Walker) -> Gait:
    """The gait on regions of ``side`` metres. Raises UsageError if they are too small."""
    omega = frequency(walker.height)
    steps = max(6, 2 * ceil(side / LONGEST_STEP / 2 - 1e-9))
    length = side / steps
    if side < LEAST_SIDE or 2 * length < walker.size:
        need = max(LEAST_SIDE, walker.size * steps / 2)
        raise UsageError(
            f"a walker of {walker.size:g} m cannot walk on regions of {side:g} m: a turn needs "
            f"room for an arc and its body, {need:g} m\n"
            "    give the map a larger 'resolution', or the model another 'motion'"
        )
    speed = walker.speed * min(1.0, length / FULL_STEP)
    seconds = period(omega, length, speed)
    aside = sway(omega, walker.foot, seconds)
    return Gait(walker, side, steps, length, speed, omega, seconds, aside)
