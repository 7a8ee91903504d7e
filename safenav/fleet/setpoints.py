"""Sampled references for robots with their own tracking controllers.

In the frame of the world (the map's origin and yaw applied): metres, seconds, radians. Times are on
the clock of the fleet's world. The stream is ``HORIZON`` samples ``PERIOD`` seconds apart, sent
once per period (paper, Section VII: a quadratic programme at 20 Hz).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, sin

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from safenav.motion.columns import sample
from safenav.motion.file.records import Foothold, Moving, Segment
from safenav.world.map import Frame

Array = NDArray[np.float64]

PERIOD = 0.05
HORIZON = 20
TABLE = 0.01
"""Seconds between the samples of a whole reference, which is interpolated linearly."""
VELOCITY, ACCELERATION, MOVING, YAW = slice(3, 6), slice(6, 9), slice(3, 9), 9
"""Columns of a row: x, y, z, their velocities, their accelerations, the yaw."""


class Setpoints(Struct, frozen=True):
    """Rows (n, 10) every ``step`` seconds from ``begin``; before and after them it rests. ``feet``:
    a walker's footholds in the order of landing, with ``down`` and ``up`` on the same clock."""

    begin: float
    step: float
    rows: Array
    feet: tuple[Foothold, ...] = ()

    @property
    def end(self) -> float:
        return self.begin + self.step * (len(self.rows) - 1)

    def at(self, now: float) -> Array:
        """Return the row at a time."""
        row: Array = self._rows(np.array([now]))[0]
        return row

    def ahead(self, now: float) -> Setpoints:
        """Return the part of the stream that is sent at a time, which is the time of its first
        row."""
        rows = self._rows(now + PERIOD * np.arange(HORIZON, dtype=np.float64))
        return Setpoints(now, PERIOD, rows, tuple(foot for foot in self.feet if foot.up > now))

    def _rows(self, times: Array) -> Array:
        last = len(self.rows) - 1
        places = (times - self.begin) / self.step
        before = np.clip(places.astype(int), 0, max(0, last - 1))
        part = np.clip(places - before, 0.0, 1.0)[:, None]
        after = np.minimum(before + 1, last)
        rows: Array = self.rows[before] * (1 - part) + self.rows[after] * part
        rows[(places < 0) | (places >= last), MOVING] = 0.0
        return rows


def sampled(pieces: Sequence[Moving], limits: Mapping[str, object], frame: Frame) -> Setpoints:
    """Return the samples of consecutive pieces of motion, given in the frame of the map."""
    tables, begin, end = [], pieces[0].t0, pieces[-1].t1
    count = int((end - begin) / TABLE) + 2
    times = np.minimum(begin + TABLE * np.arange(count), end)
    bounds = np.searchsorted(times, [piece.t1 for piece in pieces], side="right")
    low = 0
    for piece, high in zip(pieces, [*bounds[:-1], count], strict=True):
        since = np.clip(times[low:high] - piece.t0, 0.0, piece.t1 - piece.t0)
        table = sample(piece, since, limits)
        tables.append(table[:, [*range(9), 11 if isinstance(piece, Segment) else 9]])
        low = max(low, high)
    rows = np.concatenate(tables)
    rows[:, YAW] = np.unwrap(rows[:, YAW]) + frame.yaw
    turn = np.array([[cos(frame.yaw), sin(frame.yaw)], [-sin(frame.yaw), cos(frame.yaw)]])
    for first in (0, 3, 6):
        rows[:, first : first + 2] = rows[:, first : first + 2] @ turn
    rows[:, :2] += frame.origin
    feet = [
        replace(foot, down=piece.t0 + foot.down, up=piece.t0 + foot.up)
        for piece in pieces
        if isinstance(piece, Segment)
        for foot in piece.feet
    ]
    places = np.array([[foot.x, foot.y] for foot in feet]).reshape(-1, 2) @ turn + frame.origin
    turned = tuple(
        replace(foot, x=float(x), y=float(y), yaw=foot.yaw + frame.yaw)
        for foot, (x, y) in zip(feet, places, strict=True)
    )
    return Setpoints(begin, TABLE, rows, tuple(sorted(turned, key=lambda foot: foot.down)))
