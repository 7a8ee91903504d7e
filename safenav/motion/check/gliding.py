"""The rules of flights and drives: pieces that join, and limits of speed and acceleration."""

from __future__ import annotations

import numpy as np

from safenav.motion.check.examination import NEAR, Examination
from safenav.motion.check.paths import Array, along, grid, power_series
from safenav.motion.file.records import Arc, Curve, Drive, Flight


def check_flight(case: Examination, flight: Flight) -> None:
    """A flyer's reference, or the way of a disc."""
    _lasting(case, flight, [curve.seconds for curve in flight.curves])
    begin = flight.t0
    for curve in flight.curves:
        t = grid(curve.seconds)
        speed, pull = (
            np.hypot(power_series(curve.x, t, order), power_series(curve.y, t, order))
            for order in (1, 2)
        )
        _limited(case, flight, begin + t, speed, "speed", "m/s")
        _limited(case, flight, begin + t, pull, "tilt", "m/s^2")
        begin += curve.seconds


def check_drive(case: Examination, drive: Drive) -> None:
    """A unicycle."""
    _lasting(case, drive, [arc.seconds for arc in drive.arcs])
    begin = drive.t0
    for arc in drive.arcs:
        t = grid(arc.seconds)
        speed, pull = (np.abs(power_series(arc.way, t, order)) for order in (1, 2))
        if arc.curvature is None:
            _limited(case, drive, begin + t, speed, "turning", "rad/s")
        else:
            _limited(case, drive, begin + t, speed, "speed", "m/s")
            _limited(case, drive, begin + t, pull, "acceleration", "m/s^2")
        begin += arc.seconds


def curve_ends(curve: Curve) -> tuple[Array, Array]:
    """x, y, z and their speeds at the start and the end of a curve."""
    t = np.array([0.0, curve.seconds])
    values = [
        power_series(axis, t, order) for order in (0, 1) for axis in (curve.x, curve.y, curve.z)
    ]
    ends = np.stack(values, axis=1)
    return ends[0], ends[1]


def arc_ends(arc: Arc) -> tuple[Array, Array]:
    """x, y, yaw and speed at the start and the end of an arc."""
    t = np.array([0.0, arc.seconds])
    poses = along(arc.x, arc.y, arc.yaw, arc.curvature, power_series(arc.way, t))
    speeds = power_series(arc.way, t, 1)
    ends = np.column_stack([poses, speeds])
    return ends[0], ends[1]


def _lasting(case: Examination, piece: Flight | Drive, seconds: list[float]) -> None:
    lasting = piece.t1 - piece.t0
    if abs(sum(seconds) - lasting) > NEAR or min(seconds, default=0) < 0:
        found = f"pieces of {sum(seconds):.4f} s in {lasting:.4f} s"
        case.wrong(piece.t0, piece.robot, "time", found)


def _limited(
    case: Examination, piece: Flight | Drive, times: Array, values: Array, limit: str, unit: str
) -> None:
    """Values of a piece within one of its robot's limits, if it has that."""
    most, worst = case.numbers[piece.robot].get(limit), int(values.argmax())
    if most is not None and values[worst] > most + NEAR:
        found = f"{values[worst]:.3f} {unit}, more than {most:g}"
        case.wrong(float(times[worst]), piece.robot, limit, found)
