"""Occupied space of a body: each piece of motion as samples of discs, for all kinds of motion."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, inf

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.file.records import Flight, Moving, Numbers, Segment, Swing
from safenav.motion.polynomial import values
from safenav.motion.walker.pendulum import Mass, mass

Array = NDArray[np.float64]
Swinging = tuple[Array, Array, Array]

STEP = 0.02
"""Seconds between samples of a body."""
MOST_SAMPLES = 5_000_000
"""Samples of one piece of motion: more than a day."""


class Disc(Struct, frozen=True):
    """A moving disc: times since the start of the motion (n), centres (n, 2), radius, and what it
    is."""

    what: str
    radius: float
    times: Array
    centres: Array


def grid(seconds: float, step: float = STEP) -> Array:
    """Times from 0 to the end, at most a step apart.

    Raises UsageError for a duration that no file of safenav has: its samples would fill the memory.
    """
    if not seconds < MOST_SAMPLES * STEP:
        most = f"expected at most {MOST_SAMPLES * STEP:,.0f} s"
        raise UsageError(f"the motion has a piece of {seconds:,.0f} s; {most}")
    count = max(1, ceil(seconds / step))
    return np.arange(count + 1, dtype=np.float64) * (seconds / count)


def discs(
    piece: Moving, radius: float, foot: float, walked: tuple[Mass, Swinging] | None
) -> list[Disc]:
    """The discs that a piece moves: the body, and of a walker its feet, of radius ``foot``, on the
    ground and in the air."""
    if isinstance(piece, Segment) and walked is not None:
        return _walking(piece, radius, foot, *walked)
    times, centres = [], []
    begin = piece.t0
    assert isinstance(piece, Flight)
    for part in piece.parts:
        t = grid(part.seconds, _step(part.x, part.y))
        times.append(begin + t)
        centres.append(np.stack([values(part.x, t), values(part.y, t)], axis=1))
        begin += part.seconds
    return [Disc("body", radius, np.concatenate(times), np.concatenate(centres))]


def _step(*coefficients: Numbers) -> float:
    """Return the seconds between samples; a body at rest needs only two."""
    return STEP if any(len(axis) > 1 for axis in coefficients) else float("inf")


def walk(segment: Segment, omega: float) -> Mass:
    """The centre of mass of a segment, at most ``STEP`` apart and at the ends of its phases."""
    ends = np.cumsum([phase.seconds for phase in segment.phases])
    still = segment.start == segment.goal and len(segment.phases) == 1
    times = np.sort(np.append(grid(float(ends[-1]), inf if still else STEP), ends[:-1]))
    return mass(segment.phases, segment.start, segment.goal, times, omega)


def swing_states(swings: Sequence[Swing]) -> Swinging:
    """Feet in the air, at most ``STEP`` apart: times since the segment's start (swings, n),
    positions (swings, n, 2) and speeds (swings, n): quintics by their Hermite form."""
    begin, end = np.array([[swing.t0, swing.t1] for swing in swings]).reshape(-1, 2).T
    seconds = end - begin
    longest = float(seconds.max(initial=STEP))
    u = grid(longest) / longest
    scale = np.stack([np.ones_like(seconds), seconds, seconds**2] * 2, axis=1)
    states = np.array([(*swing.start, *swing.goal) for swing in swings]).reshape(-1, 6, 3)
    ends = states[:, :, :2] * scale[:, :, None]
    place, speed = np.zeros((2, len(swings), len(u), 2))
    for coefficient in np.moveaxis(_HERMITE.T[::-1] @ ends, 1, 0)[:, :, None]:
        speed *= u[:, None]
        speed += place
        place *= u[:, None]
        place += coefficient
    times = begin[:, None] + seconds[:, None] * u
    return times, place, np.hypot(speed[:, :, 0], speed[:, :, 1]) / seconds[:, None]


_HERMITE = np.array(
    [
        (1, 0, 0, -10, 15, -6),
        (0, 1, 0, -6, 8, -3),
        (0, 0, 0.5, -1.5, 1.5, -0.5),
        (0, 0, 0, 10, -15, 6),
        (0, 0, 0, -4, 7, -3),
        (0, 0, 0, 0.5, -1, 0.5),
    ]
)
"""Rows: contribution of each boundary value of a quintic (position, speed, acceleration; start,
goal) to its coefficients, over a unit of time."""


def _walking(
    segment: Segment, radius: float, foot: float, path: Mass, swinging: Swinging
) -> list[Disc]:
    found = [Disc("body", radius, segment.t0 + path.times, path.states[:, :2])]
    if segment.feet:
        feet = np.array([(hold.down, hold.x, hold.y) for hold in segment.feet])
        found.append(Disc("foot", foot, segment.t0 + feet[:, 0], feet[:, 1:]))
    if segment.swings:
        times, places, _ = swinging
        found.append(Disc("swinging foot", foot, segment.t0 + times.ravel(), places.reshape(-1, 2)))
    return found
