"""A walker in the simulation: an inverted pendulum that keeps its balance on its footsteps.

The mass at height h falls away from the centre of pressure p: c'' = omega^2 (c - p). Its controller
can choose p only under the feet on the ground, and where the next foot lands: it corrects the
divergent part of its state, c + c'/omega, by both (Khadiv et al. 2020, without the step timing).
What these cannot correct makes it fall. Feet are the planned ones, each moved by its correction.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, sin

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from safenav.fleet.setpoints import Setpoints
from safenav.motion.file.records import Foothold

Array = NDArray[np.float64]
Point = tuple[float, float]

QUICK = 4.0
"""1/s: how fast the error of the divergent part decays while p is under the feet."""
SOLE = (0.08, 0.04)
"""Metres that p may move from the middle of a foot, ahead and aside."""
REACH = 0.10
"""Metres by which a foot may land beside its foothold."""
FALLEN = 0.30
"""Metres of error in the divergent part from which on no step saves it."""


class BalancedWalk(Struct):
    """``landed``: the corrections (x, y) of the feet on the ground, by side and time of landing."""

    landed: dict[tuple[int, float], Point] = field(default_factory=dict)

    def pull(
        self, state: Sequence[float], row: Array, reference: Setpoints, now: float, omega: float
    ) -> Point | None:
        """The acceleration (x, y) in a state [x, y, vx, vy] beside a row of the reference; None if
        it falls."""
        place, planned = state[:2], row.tolist()
        error = [place[i] - planned[i] + (state[2 + i] - planned[3 + i]) / omega for i in (0, 1)]
        if hypot(*error) > FALLEN:
            return None
        feet = _on_ground(reference, now)
        known, self.landed = self.landed, {}
        for foot in feet:
            key = (foot.side, foot.down)
            stepped = foot.down > reference.begin  # not one that it stands on at first
            fresh = (_within(1.1 * error[0], REACH), _within(1.1 * error[1], REACH))
            self.landed[key] = known.get(key, fresh if stepped else (0.0, 0.0))
        gain = 1 + QUICK / omega
        wanted = [planned[i] - planned[6 + i] / omega**2 + gain * error[i] for i in (0, 1)]
        shifts = [self.landed[foot.side, foot.down] for foot in feet]
        middles = [(f.x + dx, f.y + dy) for f, (dx, dy) in zip(feet, shifts, strict=True)]
        x, y = _under(wanted[0], wanted[1], middles, feet[-1].yaw)
        return omega**2 * (place[0] - x), omega**2 * (place[1] - y)


def _on_ground(reference: Setpoints, now: float) -> list[Foothold]:
    """The feet on the ground; before and after the reference, those that it begins and ends on."""
    moment = max(now, reference.begin)
    found = [foot for foot in reference.feet if foot.down <= moment < foot.up]
    if found:
        return found
    last = max(foot.up for foot in reference.feet) - 1e-6
    return [f for f in reference.feet if f.down <= last < f.up] or [reference.feet[-1]]


def _under(x: float, y: float, middles: Sequence[Point], yaw: float) -> Point:
    """The point nearest to x and y in the box around the soles, in the direction ``yaw``."""
    c, s = cos(yaw), sin(yaw)
    ahead = [mx * c + my * s for mx, my in middles]
    aside = [my * c - mx * s for mx, my in middles]
    u = min(max(x * c + y * s, min(ahead) - SOLE[0]), max(ahead) + SOLE[0])
    v = min(max(y * c - x * s, min(aside) - SOLE[1]), max(aside) + SOLE[1])
    return u * c - v * s, u * s + v * c


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
