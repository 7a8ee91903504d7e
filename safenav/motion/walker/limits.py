"""The demands of a walker's primitives, compared with its limits."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from math import cos, hypot, sin

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from safenav.motion.pendulum import sampled
from safenav.motion.polynomial import between, derivative, values
from safenav.motion.walker import primitives
from safenav.motion.walker.primitives import LEFT, RIGHT, Primitive
from safenav.pace.gait import Gait

SAMPLES = 200


class Demand(Struct, frozen=True):
    """The longest step (m), the least distance by which a foot lands on its own side of the
    other (m), the friction needed (of the ground's normal force), the fastest swing (m/s)."""

    step: float
    aside: float
    friction: float
    swing: float


LIMITS = Demand(step=0.65, aside=0.2, friction=0.45, swing=3.0)
"""Limits of the walker (docs/motion.md); ``aside`` is a lower bound, the others are upper ones."""


RECOVERING = replace(LIMITS, aside=0.15, friction=0.5)
"""Limits while it recovers from pushes."""


def demand(gait: Gait, primitive: Primitive) -> Demand:
    times = np.linspace(0, primitive.seconds, SAMPLES)
    states, pressures = sampled(
        primitive.durations,
        primitive.pressures,
        primitive.start,
        primitive.goal,
        times,
        gait.omega,
    )
    off = np.hypot(*(states[:, :2] - pressures).T).max()
    step, aside = 0.0, np.inf
    for before, after in pairwise(primitive.footholds):
        way = (after.x - before.x, after.y - before.y)
        step = max(step, hypot(*way))
        if before.side != after.side:
            yaw = (before.yaw + after.yaw) / 2
            aside = min(aside, after.side * (way[1] * cos(yaw) - way[0] * sin(yaw)))
    fastest = 0.0
    for swing in primitive.swings:
        span = np.linspace(0, swing.t1 - swing.t0, 50)
        paths = between(swing.t1 - swing.t0, swing.start, swing.goal)[:2]
        speed = np.hypot(*(values(derivative(path), span) for path in paths))
        fastest = max(fastest, float(speed.max()))
    return Demand(step, aside, float(off) / gait.walker.height, fastest)


@lru_cache(maxsize=64)
def most_demanding(gait: Gait) -> Demand:
    """The largest demands of a gait's primitives."""
    found = [primitives.stop(gait, LEFT)]
    for way in (0, 1, -1):
        found += [primitives.walk(gait, way, LEFT), primitives.start(gait, way, LEFT)]
    found.append(primitives.walk(gait, LEFT, RIGHT))
    all_of = [demand(gait, primitive) for primitive in found]
    return Demand(
        step=max(d.step for d in all_of),
        aside=min(d.aside for d in all_of),
        friction=max(d.friction for d in all_of),
        swing=max(d.swing for d in all_of),
    )


def broken(found: Demand) -> str | None:
    """The first limit that a demand breaks, in words; None if it keeps all."""
    for field in Demand.__struct_fields__:
        value, limit = getattr(found, field), getattr(LIMITS, field)
        if (value < limit) if field == "aside" else (value > limit):
            return _WORDS[field].format(value=value, limit=limit)
    return None


_WORDS = {
    "step": "a step of {value:.2f} m is longer than {limit:g} m",
    "aside": "its feet come within {value:.2f} m of each other, the least is {limit:g} m",
    "friction": "it needs a friction of {value:.2f}, more than {limit:g}",
    "swing": "a foot swings at {value:.1f} m/s, faster than {limit:g} m/s",
}
