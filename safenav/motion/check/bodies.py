"""The rule of distance: bodies of robots in conflict never touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from safenav.motion.check.finding import Finding, Report
from safenav.motion.check.paths import Array, discs
from safenav.motion.check.room import TOUCH
from safenav.motion.file.records import Moving

STEP = 0.05
"""Seconds between the instants at which distances are measured."""


def check_distances(
    pieces: Mapping[str, Sequence[Moving]],
    limits: Mapping[str, Mapping[str, object]],
    conflicts: Mapping[str, frozenset[str]],
    makespan: float,
    report: Report,
) -> None:
    """Two robots that must not share a region are farther apart than their sizes."""
    times: Array = np.arange(0.0, makespan, STEP)
    if not len(times):
        return
    where: dict[str, Array] = {}
    for one, other in combinations(pieces, 2):
        if other not in conflicts[one] and one not in conflicts[other]:
            continue
        for name in (one, other):
            if name not in where:
                where[name] = places(pieces[name], limits[name], times)
        radii = (radius(limits[one]), radius(limits[other]))
        apart = np.hypot(*(where[one] - where[other]).T)
        nearest = int(apart.argmin())
        if apart[nearest] < sum(radii) - TOUCH:
            what = (
                f"its body is {apart[nearest]:.3f} m from that of {one}, and must be at least "
                f"{sum(radii):.3f} m"
            )
            report(Finding(float(times[nearest]), other, "distance", what))


def radius(limits: Mapping[str, object]) -> float:
    """The radius of the disc that its body fits in, in metres."""
    size = limits.get("size", 0.0)
    return float(size) / 2 if isinstance(size, int | float) else 0.0


def places(pieces: Sequence[Moving], limits: Mapping[str, object], times: Array) -> Array:
    """The middle of a body (n, 2) at some times, by its pieces of motion."""
    bodies = [discs(piece, limits)[0] for piece in pieces]
    samples = np.concatenate([body.times for body in bodies])
    centres = np.concatenate([body.centres for body in bodies])
    order = np.argsort(samples, kind="stable")
    samples, centres = samples[order], centres[order]
    columns = [np.interp(times, samples, centres[:, axis]) for axis in (0, 1)]
    return np.stack(columns, axis=1)
