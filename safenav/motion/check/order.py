"""The rules of order, of actions and of charge.

A motion gives each line of its trace a time. The judge of traces judges the run at these times;
this module compares pieces, reservations and actions with the times. Lines keep the serial order if
robots depend on each other. A robot acts at rest, at the place in the trace, and does not pass an
obstacle before it has resolved it. A robot without charge stands still."""

from collections.abc import Iterator, Sequence

import numpy as np

from safenav.judge.engine import judge
from safenav.judge.rules import RULES
from safenav.motion import timing
from safenav.motion.check.examination import STILL, Examination, Finding
from safenav.motion.check.walk import NEAR, Array
from safenav.motion.file import Action, Moving, Release, Reserve
from safenav.pace.robot import ACTION
from safenav.trace import records
from safenav.trace.file import Trace, as_data
from safenav.trace.vocabulary import ChangeCause, MoveEnd

JUDGED = {
    **dict.fromkeys(("continuity", "mobility"), "order"),
    **{"collision": "overlap", "unresolved-obstacle": "obstacle", "resolution": "action"},
}
"""The trace rules with findings that depend on a motion's times, by their names for motions."""
ELSEWHERE = (
    *(records.Synthesis, records.Plan, records.PlanEnd, records.Push, records.Pop, records.Duty),
    *(records.Goal, records.Belief, records.Request),
)
"""Lines that these rules ignore."""
DECISIONS = records.Synthesis | records.Plan | records.PlanEnd


Step = tuple[records.Depart, records.Arrive | None, int]
"""A step of the trace and the region in which it ends."""


def check_order(case: Examination) -> None:
    """Check that a motion's pieces, reservations and actions are those of a run that its trace
    allows."""
    serial = timing.dated(case.trace, timing.paces_of(case.trace, case.motion.header))
    trace = timing.ordered(case.trace, serial)
    case.findings += disorder(trace, serial)
    _steps(case, trace)
    _reservations(case, trace)
    _actions(case, trace)
    _charges(case, trace)


def disorder(trace: Trace, serial: Sequence[records.Record]) -> Iterator[Finding]:
    """Yield the findings about a trace by the rules of live runs, at the times of its lines.
    ``serial``: the lines in the trace's order, where robots move only after decisions."""
    live = timing.by_instants(trace)
    lines = [each for each in live.records if not isinstance(each, ELSEWHERE)]
    data = map(as_data, (live.header, *lines))
    for found in judge(data, [rule for rule in RULES if rule.name in JUDGED]).findings:
        robot, t = found.robot or "", lines[found.line - 2].t or 0.0
        told = found.explanation.removeprefix(f"{robot} ")
        yield Finding(t, robot, JUDGED[found.rule], told)
    decided = 0.0
    for record in serial:
        t = record.t or 0.0
        if isinstance(record, DECISIONS):
            decided = t
        elif isinstance(record, records.Depart | records.Act) and (early := decided - t) > NEAR:
            what = f"begins {early:.3f} s before the decision that it follows"
            yield Finding(t, record.robot, "order", what)


def _steps(case: Examination, trace: Trace) -> None:
    """Check that each robot's pieces between two regions carry out its steps in order and in
    time."""
    steps: dict[str, list[Step]] = {name: [] for name in case.trace.robots}
    for depart, arrive in trace.steps:
        if arrive is None or arrive.at != depart.from_:
            to = depart.to if arrive is None else arrive.at
            steps[depart.robot].append((depart, arrive, to))
    for name, wanted in steps.items():
        mine = [piece for piece in case.pieces[name] if piece.origin != piece.to]
        for (depart, arrive, to), piece in zip(wanted, mine, strict=False):
            if (piece.tick, piece.origin, piece.to) != (depart.tick, depart.from_, to):
                what = f"moves {piece.origin} -> {piece.to} in tick {piece.tick}; the trace moves "
                what += f"{depart.from_} -> {to} in tick {depart.tick}"
                case.wrong(piece.t0, name, "order", what)
                break
            t = piece.t1 if arrive is None else arrive.t or 0.0
            if piece.t0 < (depart.t or 0.0) - NEAR or abs(piece.t1 - t) > NEAR:
                what = f"moves to {to} until {piece.t1:.3f} s; in the trace until {t:.3f} s"
                case.wrong(piece.t0, name, "clock", what)
        if len(mine) != len(wanted):
            t = mine[-1].t1 if mine else 0.0
            what = f"has {len(mine)} moves; the trace has {len(wanted)}"
            case.wrong(t, name, "order", what)


def _reservations(case: Examination, trace: Trace) -> None:
    """Check that regions are reserved and released at the times of the steps."""
    starts = {name: robot.start.region for name, robot in trace.robots.items()}
    reserved = {(name, start, True): [0.0] for name, start in starts.items()}
    for depart, arrive in trace.steps:
        reserved.setdefault((depart.robot, depart.to, True), []).append(depart.t or 0.0)
        if arrive is not None and arrive.result is not MoveEnd.LOST:
            left = depart.to if arrive.at == depart.from_ else depart.from_
            reserved.setdefault((depart.robot, left, False), []).append(arrive.t or 0.0)
    for line in case.motion.lines:
        if not isinstance(line, Reserve | Release):
            continue
        times = reserved.get((line.robot, line.region, isinstance(line, Reserve)), [])
        near = next((t for t in times if abs(t - line.t) < NEAR), None)
        if near is None:
            word = "reserves" if isinstance(line, Reserve) else "releases"
            what = f"{word} region {line.region} at {line.t:.3f} s, but not in the trace"
            case.wrong(line.t, line.robot, "clock", what)
        else:
            times.remove(near)
    for (name, region, begins), times in reserved.items():
        for t in times:
            what = f"never {'reserves' if begins else 'releases'} region {region}"
            case.wrong(t, name, "clock", what)


def _actions(case: Examination, trace: Trace) -> None:
    """Check that all participants of each action of the trace act at its time, all
    simultaneously."""
    waiting = list(case.actions)
    acts = [({*a.robots}, a.t or 0.0, end.t or 0.0) for a, end in trace.acts if end is not None]
    for wanted in timing.actions_of(trace)[0]:
        done = [*_done(case, wanted, trace.records[wanted.index], waiting)]
        times = {(action.t0, action.t1) for action in done}
        if len(times) > 1:
            what = f"acts on {wanted.obstacle}, but not at the same time as its partners"
            case.wrong(min(times)[0], wanted.robots[0], "action", what)
        for t0, t1 in times:
            # A robot there takes part in a joint action even without a request.
            spans = (span for who, *span in acts if who & {*wanted.robots})
            if not any(begin < t0 + NEAR and t1 < end + NEAR for begin, end in spans):
                what = f"acts on {wanted.obstacle} until {t1:.3f} s; in the trace at another time"
                case.wrong(t0, wanted.robots[0], "clock", what)
    for action in waiting:
        what = f"resolves {action.obstacle}, which the trace does not (tick {action.tick})"
        case.wrong(action.t0, action.robot, "action", what)


def _done(
    case: Examination, wanted: timing.TimedAction, record: records.Record, waiting: list[Action]
) -> Iterator[Action]:
    """Yield the actions of the motion that carry out one action of the trace, and remove them from
    those ``waiting``. Check that each robot acts where it is and for long enough."""
    assert isinstance(record, records.Part | records.Resolved)
    for robot in wanted.robots:
        mine = (a for a in waiting if (a.robot, a.obstacle) == (robot, wanted.obstacle))
        if (done := next(mine, None)) is None:
            what = f"never acts on {wanted.obstacle}"
            case.wrong(record.t or 0.0, robot, "action", what)
            continue
        waiting.remove(done)
        _performed(case, done, record.at if robot == record.robot else None)
        # Only the trace of a live run states the duration.
        lasts = max(0.0, done.t1 - done.t0) if case.trace.header.live else ACTION
        if abs(done.t1 - done.t0 - lasts) > NEAR or done.action != wanted.action:
            what = f"performs '{done.action}' for {done.t1 - done.t0:.3f} s on {done.obstacle}"
            case.wrong(done.t0, robot, "action", what)
        yield done


def _performed(case: Examination, action: Action, at: int | None) -> None:
    """Check that a robot performs an action at rest, in the region ``at``, on its obstacle."""

    def wrong(found: str, rule: str = "action") -> None:
        case.wrong(action.t0, action.robot, rule, found)

    region = case.obstacles[action.obstacle].region
    if region != action.region:
        wrong(f"acts on {action.obstacle} in region {action.region}, not {region}")
    path = case.body(action.robot, action.t0, action.t1)
    if len(path) == 0:
        return  # the rule of continuity reports it
    if (moved := _moved(path)) > STILL:
        wrong(f"moves by {moved:.3f} m while it acts on {action.obstacle}")
    if at is not None:
        off = float(case.grid.distance(path[:1], case.grid.place(at))[0])
        if off > STILL:
            wrong(f"is {off:.3f} m outside region {at} while it acts on {action.obstacle}")
    if (past := _past(case, region, action)) > STILL:
        wrong(f"passes {action.obstacle} by {past:.3f} m before it is resolved", "obstacle")


def _moved(path: Array) -> float:
    """Return the greatest distance in metres between a position of the path and the first one."""
    return float(np.hypot(*(path - path[0]).T).max()) if len(path) else 0.0


def _past(case: Examination, at: int, action: Action) -> float:
    """Return the metres by which a robot passes the centre of its region before it has resolved the
    obstacle there; 0 for any other action."""
    own = case.pieces[action.robot]
    entering = [p for p in own if p.to == at and p.origin != at and p.t1 <= action.t0 + NEAR]
    here = [p for p in own if p.t0 <= action.t0 + NEAR and p.t1 >= action.t0 - NEAR]
    if not entering or any(p.to != at for p in here):
        return 0.0
    last = entering[-1]
    (col, row), (from_col, from_row) = case.grid.place(at), case.grid.place(last.origin)
    ahead = np.array([col - from_col, row - from_row], dtype=float)
    path = case.body(action.robot, last.t0, action.t1)
    return float(((path - case.grid.centre(at)) @ ahead).max())


def _charges(case: Examination, trace: Trace) -> None:
    """Check that a robot without charge, once at rest, does not move until its battery is
    replaced."""
    arrived: dict[str, float] = {}
    since: dict[str, float] = {}
    spans: list[tuple[str, float, float]] = []
    for record in trace.records:
        t = record.t or 0.0
        match record:
            case records.Arrive():
                arrived[record.robot] = t
            case records.Service(cause=ChangeCause.BATTERY, active=False):
                since[record.robot] = arrived.get(record.robot, 0.0)
            case records.Service(cause=ChangeCause.BATTERY) if record.robot in since:
                spans.append((record.robot, since.pop(record.robot), t))
    spans += [(name, begin, case.makespan) for name, begin in since.items()]
    for name, begin, until in spans:
        for piece in case.pieces[name]:
            if abs(piece.t0 - begin) < NEAR and _comes_to_rest(case, piece):
                begin = piece.t1
                break
        if (moved := _moved(case.body(name, begin, until))) > STILL:
            what = f"moves by {moved:.3f} m without charge, before {until:.3f} s"
            case.wrong(begin, name, "charge", what)


def _comes_to_rest(case: Examination, piece: Moving) -> bool:
    """Return whether a piece of motion only brings a robot to rest: the stop of a walker, or the
    path to the centre of its region for a robot that has acted short of it."""
    path = case.body(piece.robot, piece.t0, piece.t1)
    off = np.hypot(*(path - case.grid.centre(piece.to)).T)
    if piece.primitive == "stop":
        return True
    return len(off) > 0 and bool(off[0] > STILL and off[-1] <= STILL)
