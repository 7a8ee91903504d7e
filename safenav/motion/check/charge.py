"""The rule of charge: a robot that is flat stands still until its battery is replaced."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from safenav.motion.check.actions import STILL, body_between
from safenav.motion.check.finding import NEAR, Finding, Report
from safenav.motion.check.order import Passage
from safenav.motion.file.records import Action, Moving
from safenav.trace.records import Appeared, Depart, Move, Resolved, Service
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import ChangeCause


def check_charge(
    trace: Trace,
    steps: Mapping[int, Passage],
    actions: Sequence[Action],
    pieces: Mapping[str, Sequence[Moving]],
    limits: Mapping[str, Mapping[str, object]],
    end: float,
    report: Report,
) -> None:
    """No robot moves between its last step before it is flat and the action that resolves the
    obstacle there; without such an action, until the ``end``."""
    ended: dict[str, float] = {}
    flat: dict[str, tuple[str, float]] = {}  # the obstacle, and since when
    there = ""

    def stood(name: str, since: float, until: float) -> None:
        for piece in pieces.get(name, ()):  # a walker comes to rest by a step on the spot
            if abs(piece.t0 - since) < NEAR and piece.primitive == "stop":
                since = piece.t1
        own = [p for p in pieces.get(name, ()) if p.t0 < until - NEAR and p.t1 > since + NEAR]
        path = body_between(own, limits[name], since, until - NEAR)
        moved = float(np.hypot(*(path - path[0]).T).max()) if len(path) else 0.0
        if moved > STILL:
            what = f"moves by {moved:.3f} m without charge, before {until:.3f} s"
            report(Finding(since, name, "charge", what))

    for record in trace.records:
        match record:
            case Move() | Depart() if record.line in steps:
                ended[record.robot] = steps[record.line].end
            case Appeared(cause=ChangeCause.BATTERY):
                there = record.obstacle
            case Service(cause=ChangeCause.BATTERY, active=False):
                flat[record.robot] = there, ended.get(record.robot, 0.0)
                there = ""
            case Resolved():
                done = [
                    a.t1 for a in actions if (a.obstacle, a.tick) == (record.obstacle, record.tick)
                ]
                for name in [n for n, (obstacle, _) in flat.items() if obstacle == record.obstacle]:
                    stood(name, flat.pop(name)[1], max(done, default=end))
            case _:
                pass
    for name, (_, since) in flat.items():
        stood(name, since, end)
