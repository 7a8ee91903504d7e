"""The motion of a run with a clock: each step and action at its times in the trace.

A robot that has more time than its step takes glides or drives more slowly, a walker stands first;
one that has less is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy

from msgspec.structs import asdict, replace

from safenav.errors import Diagnostic, InputError
from safenav.motion.file import (
    Action,
    Curve,
    Flight,
    Line,
    Measured,
    MotionOutcome,
    Moving,
    Release,
    Reserve,
    Segment,
)
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Crossing, Mover
from safenav.motion.timing import TimedAction, actions_of, by_command
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.vocabulary import MoveEnd

STANDING = 1.0
"""Motion length in seconds for runs without moves."""
SLACK = 1e-6
"""Seconds that are rounding."""


def scheduled(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[Line, ...], MotionOutcome]:
    """Return the lines of the motion by which these movers, whose time is 0, carry out a trace.
    Raises InputError if they cannot: a step leaves too little time, or a robot changes its region
    without a step."""
    run = _Schedule(trace, floor, movers)
    for record in trace.records:
        run.take(record)
    return run.end()


def reservations(trace: Trace) -> Iterator[Line]:
    """Yield the reservations of a run with a clock."""
    for name, robot in trace.header.scenario.robots.items():
        yield Reserve(name, robot.start, 0.0)
    for depart, arrive in trace.steps:
        yield Reserve(depart.robot, depart.to, time_of(depart))
        if arrive is not None and arrive.result is not MoveEnd.LOST:
            left = depart.to if arrive.at == depart.from_ else depart.from_
            yield Release(arrive.robot, left, time_of(arrive))


class _Schedule:
    def __init__(self, trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]) -> None:
        self._trace, self._floor, self._movers = trace, floor, movers
        self._lines = [*reservations(trace)]
        actions, self._short = actions_of(trace)
        self._actions = by_command(actions)
        self._departs: dict[str, records.Depart] = {}
        """The steps in progress."""
        self._acts = {act.command: act for act, _ in trace.acts}
        self._due: set[str] = set()
        """Robots that have acted in their own region, and must resume from there."""

    def take(self, record: records.Record) -> None:
        match record:
            case records.Depart():
                self._departs[record.robot] = record
            case records.Arrive():
                self._arrive(self._departs.pop(record.robot), record)
            case records.ActionEnd() if record.command in self._acts:
                self._act(self._acts[record.command], record)

    def _arrive(self, depart: records.Depart, arrive: records.Arrive) -> None:
        name, region = depart.robot, self._movers[depart.robot].region
        if arrive.at == depart.from_ == region:
            return  # it stays at rest
        if depart.from_ != region:
            found = f"{name} departs from region {depart.from_}, but was in region {region}"
            raise self._refused(depart, f"{found}: no motion shows how it came there")
        if arrive.at != depart.to:
            found = f"{name} was sent to region {depart.to}, but arrives in region {arrive.at}"
            raise self._refused(arrive, f"{found}: no motion shows how it came there")
        begin, end = time_of(depart), time_of(arrive)
        natural = self._step(depart, end)
        if natural > end + SLACK:
            raise self._refused(
                depart,
                f"{name} takes {end - begin:.2f} s from region {depart.from_} to "
                f"{depart.to}; its motion takes {natural - begin:.2f} s",
                "change 'motion' or 'speed' of its model, or the side of regions: --side",
            )

    def _step(self, depart: records.Depart, end: float | None) -> float:
        """Carry out a step until ``end``, or at the robot's own pace if the trace does not record
        it. Return its earliest end."""
        heading = self._floor.heading(depart.from_, depart.to)
        short = depart.command in self._short
        step = Crossing(depart.tick, depart.from_, depart.to, heading, short)
        mover = self._movers[depart.robot]
        self._rest(mover, step.tick, time_of(depart))
        before = copy(mover)
        moved = mover.move(step)
        natural = mover.time
        if end is not None and end > natural + SLACK:
            vars(mover).update(vars(before))
            return self._step_slowly(mover, step, end)
        self._lines += moved
        return natural

    def _step_slowly(self, mover: Mover, step: Crossing, end: float) -> float:
        """Carry out a step that has more time than it needs."""
        self._lines += mover.halt(step.tick)
        ahead = copy(mover)
        walks = any(isinstance(piece, Segment) for piece in ahead.move(step))
        if walks and end > ahead.time + SLACK:
            self._lines += mover.rest(step.tick, mover.time + end - ahead.time)
        begun = mover.time
        moved = mover.move(step)
        natural = mover.time
        if end > natural + SLACK:
            moved = [_slower(piece, begun, (end - begun) / (natural - begun)) for piece in moved]
            mover.time = end
        self._lines += moved
        return natural

    def _act(self, act: records.Act, acted: records.ActionEnd) -> None:
        """Carry out the actions of a command one after the other."""
        actions = self._actions.get(acted.command, [])
        idle = self._movers.keys() - self._departs.keys()
        unasked = sorted(idle & {name for one in actions for name in one.robots} - {*act.robots})
        team = {name: self._movers[name] for name in (*act.robots, *unasked)}
        tick, begin, end = acted.tick, time_of(act), time_of(acted)
        for mover in team.values():
            near = bool(actions) and actions[0].region == mover.region
            self._rest(mover, tick, begin, stays=near and begin < mover.time + SLACK)
            self._lines += mover.halt(tick)
        ready, name = max((mover.time, name) for name, mover in team.items())
        if ready > end + SLACK:
            late = f"{name} acts until {end:.2f} s, but comes to rest only at {ready:.2f} s"
            raise self._refused(acted, late)
        lasting = max(mover.values.get("action_seconds", 2.0) for mover in team.values())
        for faces in (True, False):  # without, if it has no time to turn from one to the next
            ahead = {name: copy(mover) for name, mover in team.items()}
            _, natural = _done(ahead, actions, tick, lasting, 0.0, end, faces)
            if natural - lasting * len(actions) <= end + SLACK:
                break
        if actions and natural > end:
            lasting = max(0.0, lasting - (natural - end) / len(actions))
        self._lines += _done(team, actions, tick, lasting, max(0.0, end - natural), end, faces)[0]
        for name, mover in team.items():
            if any(name in one.robots and one.region == mover.region for one in actions):
                self._due.add(name)
            self._lines += mover.wait(tick, end)

    def _rest(self, mover: Mover, tick: int, until: float, *, stays: bool = False) -> None:
        """Rest until then: in the centre of the region, unless the robot ``stays`` where it has
        acted."""
        if mover.robot in self._due and not stays:
            self._due.discard(mover.robot)
            self._lines += mover.resume(tick)
        if until > mover.time + SLACK:
            self._lines += mover.halt(tick)
            self._lines += mover.wait(tick, until)

    def _refused(self, record: records.Record, found: str, hint: str = "") -> InputError:
        return InputError([Diagnostic(self._trace.source, record.line, 1, found, hint)])

    def end(self) -> tuple[tuple[Line, ...], MotionOutcome]:
        """Let all robots come to rest, and rest until all of them do and the run has ended."""
        for depart in self._departs.values():  # under way when the run ends
            if depart.from_ == self._movers[depart.robot].region:
                self._step(depart, None)
        tick = max((getattr(line, "tick", 0) for line in self._lines), default=0)
        movers = self._movers.values()
        for mover in movers:
            self._rest(mover, tick, 0.0)
            self._lines += mover.halt(tick)
        until = max([end_of(self._trace), *(mover.time for mover in movers)]) or STANDING
        for mover in movers:
            self._lines += mover.wait(tick, until)
        return tuple(sorted(self._lines, key=when)), MotionOutcome(until)


def when(line: Line) -> tuple[float, int]:
    """Order by time; at the same time ends come before beginnings."""
    if isinstance(line, Release):
        return line.t, 0
    if isinstance(line, Measured):
        return line.rows[0].t, 2
    time = line.t0 if hasattr(line, "t0") else line.t
    return time, 1 if isinstance(line, Reserve) else 2


def _done(
    team: Mapping[str, Mover],
    actions: Sequence[TimedAction],
    tick: int,
    lasting: float,
    pause: float,
    end: float,
    faces: bool,
) -> tuple[list[Line], float]:
    """Return the lines of robots that carry out actions one after the other, the first after a
    ``pause``, each for ``lasting`` seconds, the last until ``end`` but for rounding; and when all
    are done. ``faces``: they turn towards each."""
    lines: list[Line] = []
    over = max((mover.time for mover in team.values()), default=0.0)
    for number, act in enumerate(actions):
        group = [mover for name, mover in team.items() if name in act.robots]
        for mover in group if faces else ():
            if number and actions[number - 1].region == mover.region != act.region:
                lines += mover.resume(tick)
            lines += mover.face(tick, act.region)
        start = max([over, *(mover.time for mover in group)]) + (0.0 if number else pause)
        over = start + lasting
        if abs(over - end) < SLACK:
            over = end
        for mover in group:
            lines += mover.wait(tick, over)
            times = (min(start, over), over)
            what = (act.action, act.obstacle, act.region)
            lines.append(Action(mover.robot, tick, *what, *times))
    return lines, over


def _slower(piece: Moving, begin: float, factor: float) -> Moving:
    """Return the same path, slower by a factor from ``begin`` on."""
    assert isinstance(piece, Flight), "a walker rests first"
    t0, t1 = (begin + (t - begin) * factor for t in (piece.t0, piece.t1))
    parts = tuple(_stretched(part, factor) for part in piece.parts)
    return replace(piece, parts=parts, t0=t0, t1=t1)


def _stretched(part: Curve, factor: float) -> Curve:
    found = {
        name: tuple(c / factor**power for power, c in enumerate(value))
        for name, value in asdict(part).items()
        if isinstance(value, tuple)
    }
    return replace(part, seconds=part.seconds * factor, **found)


def time_of(record: records.Record) -> float:
    """Return the time of a line, in seconds."""
    return record.t or 0.0


def end_of(trace: Trace) -> float:
    """Return the time of the last line of a trace, in seconds."""
    return max(map(time_of, trace.records), default=0.0)
