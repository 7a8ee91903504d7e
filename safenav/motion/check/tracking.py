"""The rules of a flight in wind: a rigid body moves by thrust, gravity and air alone, inside the
regions that the flyer has reserved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from safenav.motion.check.examination import NEAR, Examination, Holding
from safenav.motion.check.paths import Array
from safenav.motion.check.room import TOUCH, outside
from safenav.motion.columns import sampled
from safenav.motion.file.records import TRACK_COLUMNS, Flight, FlownTrack

MASS, GRAVITY, DRAG = 0.5, 9.81, 0.25
PULL = 1.5
"""Tolerance (m/s^2) of the mean acceleration between two samples: attitude and wind change within a
twentieth of a second."""
STEP = 0.05
"""The longest time between two samples, in seconds."""
WAY = 0.01
"""Tolerance (m) of the path between two samples, computed from their mean speed."""


def check_wind(case: Examination) -> None:
    """The flights that were simulated: every flyer's, to the end, if there is wind."""
    for name, limits in case.motion.header.robots.items():
        tracks, flights = case.motion.of(FlownTrack, name), case.motion.of(Flight, name)
        if not tracks:
            if case.motion.header.gust > 0 and limits.get("kind") == "flyer" and flights:
                case.wrong(0.0, name, "track", "no flight in the wind is recorded")
            continue
        before = len(case.findings)
        begin = 0.0
        for track in tracks:
            if abs(track.t0 - begin) > NEAR:
                what = f"no flight in the wind is recorded from {begin:.3f} s on"
                case.wrong(begin, name, "track", what)
                return
            begin = track.t0 + track.step * len(track.rows)
            _rows(case, track)
        if begin < case.makespan - tracks[-1].step:
            what = f"no flight in the wind is recorded from {begin:.3f} s on"
            case.wrong(begin, name, "track", what)
        if len(case.findings) == before:
            for track in tracks:
                _flown(case, track, flights)


def _rows(case: Examination, track: FlownTrack) -> None:
    def wrong(row: int, rule: str, found: str) -> None:
        case.wrong(track.t0 + row * track.step, track.robot, rule, found)

    if not 0 < track.step <= STEP + NEAR or any(len(row) != TRACK_COLUMNS for row in track.rows):
        wrong(0, "track", f"expected rows of {TRACK_COLUMNS} numbers, at most {STEP:g} s apart")
        return
    if len(track.rows) != len(track.errors):
        wrong(0, "track", "the numbers of rows and of errors differ")
        return
    rows = np.array(track.rows)
    spin = np.abs(np.hypot.reduce(rows[:, 6:10], axis=1) - 1)
    if spin.max() > 1e-4:
        wrong(int(spin.argmax()), "attitude", "a quaternion whose length is not 1")
        return
    moved = np.diff(rows[:, :3], axis=0) - (rows[1:, 3:6] + rows[:-1, 3:6]) / 2 * track.step
    missed = np.abs(moved).max(axis=1, initial=0.0)
    if len(missed) and missed.max() > WAY:
        what = f"it moves {missed.max():.3f} m away from where its velocity leads"
        wrong(int(missed.argmax()), "dynamics", what)
    pull = _pull(rows)
    change = np.diff(rows[:, 3:6], axis=0) / track.step - (pull[1:] + pull[:-1]) / 2
    missed = np.abs(change).max(axis=1, initial=0.0)
    if len(missed) and missed.max() > PULL:
        what = f"its velocity changes by {missed.max():.2f} m/s^2 more than its thrust explains"
        wrong(int(missed.argmax()), "dynamics", what)
    lean = np.hypot(rows[:, 7], rows[:, 8])
    most = np.sin(np.arctan(np.sqrt(2) * case.numbers[track.robot]["tilt"] / GRAVITY) / 2) * 1.3
    if lean.max() > most:
        angle = float(np.degrees(2 * np.arcsin(min(1.0, lean.max()))))
        wrong(int(lean.argmax()), "tilt", f"it leans by {angle:.0f} degrees")


def _flown(case: Examination, track: FlownTrack, flights: Sequence[Flight]) -> None:
    """The body of one flyer in wind stays inside its regions, and its errors are those that the
    file records."""
    rows: Array = np.array(track.rows, dtype=np.float64)
    times: Array = track.t0 + track.step * np.arange(len(rows), dtype=np.float64)
    spans = [
        Holding(track.robot, region, max(held.begin, flight.t0), min(held.end, flight.t1))
        for flight in flights
        if flight.t0 < times[-1] + NEAR and flight.t1 > times[0] - NEAR
        for region in {flight.origin, flight.to}
        for held in case.held
        if (held.robot, held.region) == (track.robot, region)
    ]
    found = outside(case, track.robot, times, rows[:, :2], spans, TOUCH)
    if found is not None:
        case.wrong(found[0], track.robot, "room", f"the wind takes it to {found[1]}")
    reference = sampled(flights, times, {})
    off = np.hypot(rows[:, 0] - reference["x"], rows[:, 1] - reference["y"])
    apart = np.abs(off - np.array(track.errors))
    if apart.max() > 1e-3:
        what = f"it is {off[apart.argmax()]:.3f} m off its reference; the recorded error differs"
        case.wrong(float(times[apart.argmax()]), track.robot, "track", what)


def _pull(rows: Array) -> Array:
    """Acceleration (n, 3) by thrust, gravity and drag."""
    w, x, y, z = rows[:, 6:10].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=1)
    air = rows[:, 3:6] - np.stack([rows[:, 14], rows[:, 15], np.zeros(len(rows))], axis=1)
    pull: Array = axis * rows[:, 13:14] / MASS - DRAG * air
    pull[:, 2] -= GRAVITY
    return pull
