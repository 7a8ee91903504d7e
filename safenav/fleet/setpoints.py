"""Sampled references for robots with their own tracking controllers.

They are in the frame of the world (with the map's origin and yaw), in metres, seconds, radians.
Times are on the clock of the transport. The stream has ``HORIZON`` samples ``PERIOD`` seconds
apart, sent once per period (paper, Section VII: a quadratic programme at 20 Hz).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.motion.columns import BODY, placed, sampled
from safenav.motion.file import Moving
from safenav.motion.flyer import HORIZON, PERIOD
from safenav.world.map import Frame

Array = NDArray[np.float64]
TABLE = 0.01
"""Seconds between the samples of a whole reference, with linear interpolation."""


class Setpoints(Struct, frozen=True):
    """Rows (n, 10) every ``step`` seconds from ``begin``, from rest to rest: x, y, z, their
    velocities and accelerations, and the yaw."""

    begin: float
    step: float
    rows: Array

    @property
    def end(self) -> float:
        return self.begin + self.step * (len(self.rows) - 1)

    def at(self, now: float) -> Array:
        """Return the interpolated row at a time."""
        last = len(self.rows) - 1
        place = max(0.0, min((now - self.begin) / self.step, last))
        before, after = self.rows[int(place)], self.rows[min(int(place) + 1, last)]
        row: Array = before + place % 1 * (after - before)
        return row

    def ahead(self, now: float) -> Setpoints:
        """Return the part of the stream to send at the time ``now``, the time of its first row."""
        rows = np.array([self.at(now + number * PERIOD) for number in range(HORIZON)])
        return Setpoints(now, PERIOD, rows)


def reference_of(pieces: Sequence[Moving], limits: Mapping[str, object], frame: Frame) -> Setpoints:
    """Return the samples of consecutive pieces of motion in the frame of the map."""
    begin, end = pieces[0].t0, pieces[-1].t1
    times = np.minimum(begin + TABLE * np.arange(int((end - begin) / TABLE) + 2), end)
    columns = placed(sampled(pieces, times, limits), (*frame.origin, frame.yaw))
    columns["yaw"] = np.unwrap(columns["yaw"])
    rows = np.stack([columns[name] for name in BODY], axis=1)
    return Setpoints(begin, TABLE, rows)
