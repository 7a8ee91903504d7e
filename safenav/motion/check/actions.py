"""The rules of actions: a robot acts at rest, where the trace says, and does not pass what it is
about to resolve before it has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from safenav.motion.check.finding import NEAR, Finding, Report
from safenav.motion.check.paths import Array, discs
from safenav.motion.check.room import Grid
from safenav.motion.file.records import Action, Moving
from safenav.trace.records import Met, Resolved
from safenav.trace.trace import Trace

STILL = 1e-6
"""Metres that a body at rest may move by rounding."""


def check_actions(
    trace: Trace,
    actions: Sequence[Action],
    pieces: Mapping[str, Sequence[Moving]],
    grid: Grid,
    limits: Mapping[str, Mapping[str, object]],
    report: Report,
) -> None:
    """Every action of the motion against the line of the trace that it carries out."""
    lines = {
        (name, record.obstacle, record.tick): record
        for record in trace.records
        if isinstance(record, Met | Resolved)
        for name in (record.robot, *(record.robots or ()))
    }
    obstacles = trace.obstacles
    for action in actions:
        record = lines.get((action.robot, action.obstacle, action.tick))
        if record is None:
            continue  # the rule of order tells it
        during = [
            piece
            for piece in pieces.get(action.robot, ())
            if piece.t0 < action.t1 - NEAR and piece.t1 > action.t0 + NEAR
        ]
        path = body_between(during, limits[action.robot], action.t0, action.t1)
        if len(path) == 0:
            continue  # the rule of continuity tells it
        moved = float(np.hypot(*(path - path[0]).T).max())
        if moved > STILL:
            what = f"moves by {moved:.3f} m while it acts on {action.obstacle}"
            report(Finding(action.t0, action.robot, "action", what))
        if action.robot == record.robot:
            off = float(grid.distance(path[:1], grid.place(record.at))[0])
            if off > STILL:
                what = f"acts on {action.obstacle} {off:.3f} m outside region {record.at}"
                report(Finding(action.t0, action.robot, "action", what))
        obstacle = obstacles.get(action.obstacle)
        if obstacle is not None:
            _behind(obstacle.region, action, pieces, grid, limits, report)


def _behind(
    at: int,
    action: Action,
    pieces: Mapping[str, Sequence[Moving]],
    grid: Grid,
    limits: Mapping[str, Mapping[str, object]],
    report: Report,
) -> None:
    """Who resolves an obstacle in its own region stays before the region's middle until then."""
    own = pieces.get(action.robot, ())
    entering = [p for p in own if p.to == at and p.origin != at and p.t1 <= action.t0 + NEAR]
    here = [p for p in own if p.t0 <= action.t0 + NEAR and p.t1 >= action.t0 - NEAR]
    if not entering or any(p.to != at for p in here):
        return
    last = entering[-1]
    (col, row), (from_col, from_row) = grid.place(at), grid.place(last.origin)
    ahead = np.array([col - from_col, row - from_row], dtype=float)
    middle = (np.array([col, row]) + 0.5) * grid.side
    since = [p for p in own if last.t0 <= p.t0 and p.t0 < action.t1 - NEAR]
    path = body_between(since, limits[action.robot], last.t0, action.t1)
    past = float(((path - middle) @ ahead).max())
    if past > STILL:
        what = f"passes {action.obstacle} by {past:.3f} m before it is resolved"
        report(Finding(action.t0, action.robot, "obstacle", what))


def body_between(
    pieces: Sequence[Moving], limits: Mapping[str, object], begin: float, end: float
) -> Array:
    """Centres of the body (n, 2) between two times."""
    found = [np.empty((0, 2))]
    for piece in pieces:
        body = discs(piece, limits)[0]
        inside = (body.times >= begin - NEAR) & (body.times <= end + NEAR)
        found.append(body.centres[inside])
    return np.concatenate(found)
