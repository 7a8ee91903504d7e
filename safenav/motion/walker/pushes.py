"""Pushes of a walker: one in each walking move, at a random instant, and its recovery."""

from __future__ import annotations

import random
from collections.abc import Sequence
from itertools import zip_longest
from math import cos, pi, sin

import numpy as np

from safenav.motion.file.records import BodyPush, Line, Segment
from safenav.motion.geometry import MetricFloor
from safenav.motion.walker.courses import Actual, PendingMove
from safenav.motion.walker.cutting import split
from safenav.motion.walker.recovery import recovered

EXACT = 1e-9
"""Metres and metres per second off the plan that are none."""
FIRST = 0.02
"""Seconds from either end of a move without a push."""


def pushed(
    segments: Sequence[Segment], floor: MetricFloor, omega: float, push: float, seed: str
) -> list[Line]:
    """The segments of one walker with a push of up to ``push`` m/s in each walking move, and the
    pushes. Raises FallenError if it cannot keep itself up."""
    chance = random.Random(seed)
    found: list[Line] = []
    actual: Actual | None = None
    courses = [PendingMove(s, floor.corridor(s.origin, s.to)) for s in segments]
    for course, following in zip_longest(courses, courses[1:]):
        planned = segment = course.segment
        if planned.primitive in ("stop", "stand"):
            following = None
        if actual is not None:
            segment = recovered(course, actual, following, omega)
        if planned.primitive.startswith("walk"):
            instant = chance.uniform(FIRST, segment.t1 - segment.t0 - FIRST)
            way, size = chance.uniform(0, 2 * pi), push * chance.uniform(0, 1) ** 0.5
            blow = (size * cos(way), size * sin(way))
            here = PendingMove(segment, course.box)
            first, hit, segment = struck(here, following, instant, blow, omega)
            found += [first, hit]
        found.append(segment)
        actual = _left(segment, planned)
    return found


def struck(
    course: PendingMove,
    following: PendingMove | None,
    instant: float,
    blow: tuple[float, float],
    omega: float,
) -> tuple[Segment, BodyPush, Segment]:
    """A move until a push that changes the velocity (m/s), the push, and the move from there."""
    first, second = split(course.segment, instant, omega)
    state = np.array(first.goal) + np.array([0.0, 0.0, *blow])
    foot = next(foot for foot in second.feet if foot.down <= 0.0)
    actual = Actual(state, (foot.x, foot.y))
    second = recovered(PendingMove(second, course.box), actual, following, omega)
    return first, BodyPush(second.robot, second.tick, second.t0, *blow), second


def _left(segment: Segment, planned: Segment) -> Actual | None:
    """Return the walker's position after a move, if it differs from the plan."""
    foot, wanted = segment.feet[-1], planned.feet[-1]
    off = np.abs(np.subtract(segment.goal, planned.goal)).max()
    if max(float(off), abs(foot.x - wanted.x), abs(foot.y - wanted.y)) < EXACT:
        return None
    return Actual(np.array(segment.goal), (foot.x, foot.y))
