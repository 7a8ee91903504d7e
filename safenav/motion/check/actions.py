"""The rules of actions and of charge: a robot acts at rest, at the place in the trace, and does not
pass an obstacle before it has resolved it; a robot without charge stands still."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from safenav.motion.check.examination import NEAR, STILL, Examination
from safenav.motion.check.order import Passage
from safenav.motion.check.paths import Array
from safenav.motion.file.records import Action, Moving
from safenav.trace.records import Appeared, Depart, Met, Move, Resolved, Service
from safenav.trace.vocabulary import ChangeCause


def check_actions(case: Examination) -> None:
    """Check every action of the motion against the line of the trace that it carries out."""
    lines = {
        (name, record.obstacle, record.tick): record
        for record in case.trace.records
        if isinstance(record, Met | Resolved)
        for name in (record.robot, *(record.robots or ()))
    }
    for action in case.actions:
        record = lines.get((action.robot, action.obstacle, action.tick))
        if record is None:
            continue  # the rule of order reports it
        path = case.body(action.robot, action.t0, action.t1)
        if len(path) == 0:
            continue  # the rule of continuity reports it
        moved = _moved(path)
        if moved > STILL:
            what = f"moves by {moved:.3f} m while it acts on {action.obstacle}"
            case.wrong(action.t0, action.robot, "action", what)
        if action.robot == record.robot:
            off = float(case.grid.distance(path[:1], case.grid.place(record.at))[0])
            if off > STILL:
                what = f"acts on {action.obstacle} {off:.3f} m outside region {record.at}"
                case.wrong(action.t0, action.robot, "action", what)
        obstacle = case.obstacles.get(action.obstacle)
        if obstacle is not None and obstacle.region != action.region:
            what = f"acts on {action.obstacle} in region {action.region}, not {obstacle.region}"
            case.wrong(action.t0, action.robot, "action", what)
        if obstacle is not None:
            _behind(case, obstacle.region, action)


def _moved(path: Array) -> float:
    """Return the maximum distance of a body from its first position."""
    return float(np.hypot(*(path - path[0]).T).max()) if len(path) else 0.0


def _behind(case: Examination, at: int, action: Action) -> None:
    """A robot that resolves an obstacle in its own region stays before the region's centre until
    then."""
    own = case.pieces[action.robot]
    entering = [p for p in own if p.to == at and p.origin != at and p.t1 <= action.t0 + NEAR]
    here = [p for p in own if p.t0 <= action.t0 + NEAR and p.t1 >= action.t0 - NEAR]
    if not entering or any(p.to != at for p in here):
        return
    last = entering[-1]
    (col, row), (from_col, from_row) = case.grid.place(at), case.grid.place(last.origin)
    ahead = np.array([col - from_col, row - from_row], dtype=float)
    middle = (np.array([col, row]) + 0.5) * case.grid.side
    path = case.body(action.robot, last.t0, action.t1)
    past = float(((path - middle) @ ahead).max())
    if past > STILL:
        what = f"passes {action.obstacle} by {past:.3f} m before it is resolved"
        case.wrong(action.t0, action.robot, "obstacle", what)


def check_charge(case: Examination, steps: Mapping[int, Passage]) -> None:
    """No robot moves from its last step before its charge is used up until the action that resolves
    the obstacle there, or until the end."""
    ended: dict[str, float] = {}
    flat: dict[str, tuple[str, float]] = {}  # the obstacle, and since when
    there = ""

    def stood(name: str, since: float, until: float) -> None:
        for piece in case.pieces[name]:
            if abs(piece.t0 - since) < NEAR and _comes_to_rest(case, piece):
                since = piece.t1
                break
        moved = _moved(case.body(name, since, until))
        if moved > STILL:
            what = f"moves by {moved:.3f} m without charge, before {until:.3f} s"
            case.wrong(since, name, "charge", what)

    for record in case.trace.records:
        if isinstance(record, Met | Resolved):
            own = (record.robot, record.obstacle, record.tick)
            acted = [a.t1 for a in case.actions if (a.robot, a.obstacle, a.tick) == own]
            ended[record.robot] = max([ended.get(record.robot, 0.0), *acted])
        match record:
            case Move() | Depart() if record.line in steps:
                ended[record.robot] = steps[record.line].end
            case Appeared(cause=ChangeCause.BATTERY):
                there = record.obstacle
            case Service(cause=ChangeCause.BATTERY, active=False):
                flat[record.robot] = there, ended.get(record.robot, 0.0)
                there = ""
            case Resolved():
                deed = (record.obstacle, record.tick)
                done = [a.t1 for a in case.actions if (a.obstacle, a.tick) == deed]
                for name in [n for n, (obstacle, _) in flat.items() if obstacle == record.obstacle]:
                    stood(name, flat.pop(name)[1], max(done, default=case.makespan))
            case _:
                pass
    for name, (_, since) in flat.items():
        stood(name, since, case.makespan)


def _comes_to_rest(case: Examination, piece: Moving) -> bool:
    """Whether a robot only comes to rest: a walker by a step on the spot; a robot that has acted
    short of the centre of its region by continuing to it."""
    if piece.origin != piece.to:
        return False
    path = case.body(piece.robot, piece.t0, piece.t1)
    middle = (np.array(case.grid.place(piece.to)) + 0.5) * case.grid.side
    off = np.hypot(*(path - middle).T)
    if piece.primitive == "stop":
        return True
    return len(off) > 0 and bool(off[0] > STILL and off[-1] <= STILL)
