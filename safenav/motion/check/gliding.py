"""The rules of flights and drives: pieces that join, and limits of speed and acceleration."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from safenav.motion.check.finding import NEAR, Finding, Report
from safenav.motion.check.paths import Array, along, grid, power_series
from safenav.motion.file.records import Arc, Curve, Drive, Flight


def check_flight(flight: Flight, limits: Mapping[str, float], report: Report) -> None:
    """A flyer's reference, or the way of a disc."""
    _lasting(flight, [curve.seconds for curve in flight.curves], report)
    begin = flight.t0
    for curve in flight.curves:
        t = grid(curve.seconds)
        speed, pull = (
            np.hypot(power_series(curve.x, t, order), power_series(curve.y, t, order))
            for order in (1, 2)
        )
        _limited(flight, begin + t, speed, limits.get("speed"), "speed", "m/s", report)
        _limited(flight, begin + t, pull, limits.get("tilt"), "tilt", "m/s^2", report)
        begin += curve.seconds


def check_drive(drive: Drive, limits: Mapping[str, float], report: Report) -> None:
    """A unicycle."""
    _lasting(drive, [arc.seconds for arc in drive.arcs], report)
    begin = drive.t0
    for arc in drive.arcs:
        t = grid(arc.seconds)
        speed, pull = (np.abs(power_series(arc.way, t, order)) for order in (1, 2))
        if arc.curvature is None:
            _limited(drive, begin + t, speed, limits.get("turning"), "turning", "rad/s", report)
        else:
            _limited(drive, begin + t, speed, limits.get("speed"), "speed", "m/s", report)
            most = limits.get("acceleration")
            _limited(drive, begin + t, pull, most, "acceleration", "m/s^2", report)
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


def _lasting(piece: Flight | Drive, seconds: list[float], report: Report) -> None:
    lasting = piece.t1 - piece.t0
    if abs(sum(seconds) - lasting) > NEAR or min(seconds, default=0) < 0:
        found = f"pieces of {sum(seconds):.4f} s in {lasting:.4f} s"
        report(Finding(piece.t0, piece.robot, "time", found))


def _limited(
    piece: Flight | Drive,
    times: Array,
    values: Array,
    limit: float | None,
    rule: str,
    unit: str,
    report: Report,
) -> None:
    if limit is None:
        return
    worst = int(values.argmax())
    if values[worst] > limit + NEAR:
        found = f"{values[worst]:.3f} {unit}, more than {limit:g}"
        report(Finding(float(times[worst]), piece.robot, rule, found))
