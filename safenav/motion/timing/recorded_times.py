"""The motion of a run with a clock: each step and action at the seconds that its trace says.

Nothing is scheduled. A robot that has more time than its step takes glides or drives more slowly; a
walker stands first. One that has less time than its motion needs is refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.motion.file.records import (
    Action,
    Curve,
    Drive,
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
from safenav.motion.timing.schedule import ACTION_SECONDS, team_of
from safenav.trace import records
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import MoveEnd

STANDING = 1.0
"""Motion length in seconds for runs without moves."""
SLACK = 1e-6
"""Seconds that are rounding."""


def motion_at_recorded_times(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[Line, ...], MotionOutcome]:
    """The lines of a trace that these movers carry out, whose time is 0. Raises InputError for what
    no motion of theirs does: too fast, or from one place to another without a step."""
    run = _Run(trace, floor, movers)
    for record in trace.records:
        run.take(record)
    return run.end()


class TraceLedger:
    """The facts of the trace alone: who has which region when, and is busy for how long."""

    def __init__(self, starts: Mapping[str, int]) -> None:
        self.lines: list[Line] = [Reserve(n, 0, region, 0.0) for n, region in starts.items()]
        self.departs: dict[str, records.Depart] = {}
        self.busy = dict.fromkeys(starts, 0.0)
        self._acts: dict[int, records.Act] = {}
        self._last = dict.fromkeys(starts, 0.0)

    def step(self, record: records.Record) -> tuple[records.Depart, records.Arrive] | None:
        """Take a line of the trace; the step that it ends, if it ends one."""
        if isinstance(record, records.Depart):
            self.departs[record.robot] = record
            self.lines.append(Reserve(record.robot, record.tick, record.to, _time(record)))
        if not isinstance(record, records.Arrive):
            return None
        depart = self.departs.pop(record.robot)
        left = depart.to if record.at == depart.from_ else depart.from_
        if record.result is not MoveEnd.LOST:
            self.lines.append(Release(record.robot, record.tick, left, _time(record)))
        self._count(record.robot, _time(depart), _time(record))
        return depart, record

    def action(self, record: records.Record) -> tuple[records.Act, records.ActionEnd] | None:
        """Take a line of the trace; the action that it ends, if it ends one."""
        if isinstance(record, records.Act):
            self._acts[record.command] = record
        if not isinstance(record, records.ActionEnd):
            return None
        act = self._acts.pop(record.command)
        for name in act.robots:
            self._count(name, _time(act), _time(record))
        return act, record

    def _count(self, robot: str, begin: float, end: float) -> None:
        self.busy[robot] += end - begin
        self._last[robot] = end

    def outcome(self, makespan: float) -> MotionOutcome:
        waiting = {name: end - self.busy[name] for name, end in self._last.items()}
        return MotionOutcome(makespan, self.busy, waiting, ())


class _Run:
    def __init__(self, trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]) -> None:
        self._trace, self._floor, self._movers = trace, floor, movers
        self._obstacles = trace.obstacles
        self._ledger = TraceLedger({name: mover.region for name, mover in movers.items()})
        self._lines = self._ledger.lines
        self._actions, self._short = actions_of(trace)
        self._due: set[str] = set()
        """Robots that have acted in their own region, and have to resume from there."""

    def take(self, record: records.Record) -> None:
        if step := self._ledger.step(record):
            self._arrive(*step)
        if action := self._ledger.action(record):
            self._acted(*action)

    def _arrive(self, depart: records.Depart, arrive: records.Arrive) -> None:
        name, region = depart.robot, self._movers[depart.robot].region
        if arrive.at == depart.from_ == region:
            return  # it stays at rest
        if depart.from_ != region:
            found = f"{name} sets out in region {depart.from_}, and was in region {region}"
            raise self._refused(depart, f"{found}: no motion shows how it came there")
        if arrive.at != depart.to:
            found = f"{name} went to region {depart.to}, and is in region {arrive.at}"
            raise self._refused(arrive, f"{found}: no motion shows how it came there")
        self._cross(depart, _time(arrive))

    def _cross(self, depart: records.Depart, end: float | None) -> None:
        """The step of a robot; at its own pace if the trace does not say when it ends."""
        mover, begin = self._movers[depart.robot], _time(depart)
        heading = self._floor.heading(depart.from_, depart.to)
        short = (depart.robot, depart.command) in self._short
        step = Crossing(depart.tick, depart.from_, depart.to, heading, short)
        self._rest(mover, depart.tick, begin)
        natural, walks = _tried(mover, step)
        end = natural if end is None else end
        if end > natural + SLACK:
            self._lines += mover.halt(depart.tick)
            natural, walks = _tried(mover, step)
            if walks and end > natural + SLACK:
                self._lines += mover.rest(depart.tick, mover.time + end - natural)
        if end < natural - SLACK:
            raise self._refused(
                depart,
                f"{depart.robot} takes {end - begin:.2f} s from region {depart.from_} to "
                f"{depart.to}; its motion takes {natural - begin:.2f} s",
                "change 'motion' or 'speed' of its model, or the side of regions: --side",
            )
        begun = mover.time
        moved = mover.move(step)
        factor = (end - begun) / (mover.time - begun)
        if abs(mover.time - end) > SLACK:
            moved = [_slower(p, begun, factor) for p in moved]
            mover.time = end
        self._lines += moved

    def _acted(self, act: records.Act, acted: records.ActionEnd) -> None:
        begin, end = _time(act), _time(acted)
        timed_actions = self._actions.get(acted.command, [])
        idle = self._movers.keys() - self._ledger.departs.keys()
        unasked = sorted(idle & {name for deed in timed_actions for name in deed.robots})
        team = {name: self._movers[name] for name in (*act.robots, *unasked)}
        for name, mover in team.items():
            stays = (
                bool(timed_actions)
                and timed_actions[0].region == mover.region
                and begin < mover.time + SLACK
            )
            self._rest(mover, acted.tick, begin, stays=stays)
            self._lines += mover.halt(acted.tick)
            if mover.time > end + SLACK:
                late = f"{name} acts until {end:.2f} s, and is at rest at {mover.time:.2f} s"
                raise self._refused(acted, late)
        lasting = max(mover.values.get(ACTION_SECONDS, 2.0) for mover in team.values())
        ahead = {name: copy(mover) for name, mover in team.items()}
        _, natural = _done(ahead, timed_actions, acted.tick, lasting, 0.0, end)
        if timed_actions and natural > end:
            lasting = max(0.0, lasting - (natural - end) / len(timed_actions))
        pause = max(0.0, end - natural)
        lines, _ = _done(team, timed_actions, acted.tick, lasting, pause, end)
        self._lines += lines
        for name, mover in team.items():
            if any(name in deed.robots and deed.region == mover.region for deed in timed_actions):
                self._due.add(name)
            if mover.time < end:
                self._lines += mover.rest(acted.tick, end)

    def _rest(self, mover: Mover, tick: int, until: float, *, stays: bool = False) -> None:
        """Rest until then; in the centre of the region, unless the robot ``stays`` where it has
        acted short of that."""
        if mover.robot in self._due and not stays:
            self._due.discard(mover.robot)
            self._lines += mover.resume(tick)
        if until > mover.time + SLACK:
            self._lines += mover.halt(tick)
            if until > mover.time:
                self._lines += mover.rest(tick, until)

    def _refused(self, record: records.Record, found: str, hint: str = "") -> InputError:
        return InputError([Diagnostic(self._trace.source, record.line, 1, found, hint)])

    def end(self) -> tuple[tuple[Line, ...], MotionOutcome]:
        for depart in self._ledger.departs.values():  # under way when the run ends
            if depart.from_ == self._movers[depart.robot].region:
                self._cross(depart, None)
        tick = max((getattr(line, "tick", 0) for line in self._lines), default=0)
        over = max((_time(record) for record in self._trace.records), default=0.0)
        for mover in self._movers.values():
            self._rest(mover, tick, 0.0)
            self._lines += mover.halt(tick)
        until = max([over, *(mover.time for mover in self._movers.values())]) or STANDING
        for mover in self._movers.values():
            if mover.time < until:
                self._lines += mover.rest(tick, until)
        return tuple(sorted(self._lines, key=when)), self._ledger.outcome(until)


def when(line: Line) -> tuple[float, int]:
    """By time; at the same time what ends comes before what begins."""
    if isinstance(line, Release):
        return line.t, 0
    if isinstance(line, Measured):
        return line.rows[0].t, 2
    time = line.t0 if hasattr(line, "t0") else line.t
    return time, 1 if isinstance(line, Reserve) else 2


def _time(record: records.Record) -> float:
    return record.t or 0.0


class TimedAction(Struct, frozen=True):
    """An act of robots on an obstacle in ``region``; ``takes``: they carry it from then on."""

    obstacle: str
    region: int
    action: str
    robots: frozenset[str]
    takes: bool


def actions_of(trace: Trace) -> tuple[dict[int, list[TimedAction]], set[tuple[str, int]]]:
    """By the command of each action: its actions, those that take a load last; robots and
    commands of the steps that end before such an obstacle in the region that they enter."""
    found: dict[int, list[TimedAction]] = {}
    short: set[tuple[str, int]] = set()
    ended: dict[tuple[str, int], records.Act] = {}
    acts: dict[int, records.Act] = {}
    entered: dict[str, tuple[int, int]] = {}
    last: set[str] = set()
    for record in trace.records:
        if isinstance(record, records.Arrive) and record.result is MoveEnd.ARRIVED:
            entered[record.robot] = record.at, record.command
        elif isinstance(record, records.Act):
            acts[record.command] = record
        elif isinstance(record, records.ActionEnd):
            act = acts[record.command]
            ended.update(((name, record.tick), act) for name in act.robots)
        elif isinstance(record, records.Met | records.Resolved):
            obstacle = trace.obstacles[record.obstacle]
            needs = obstacle.all_needs
            need = record.need if isinstance(record, records.Met) else len(needs) - 1
            by = ended.get((record.robot, record.tick))
            told = isinstance(record, records.Resolved) and obstacle.name in last
            last.discard(obstacle.name)
            if isinstance(record, records.Met) and need == len(needs) - 1:
                last.add(obstacle.name)
            if by is not None and not told:
                takes = need + 1 < len(needs) and bool(needs[need + 1].same)
                place = (obstacle.name, obstacle.region, needs[need].action)
                at = {name: robot.start for name, robot in trace.header.scenario.robots.items()}
                at |= {name: region for name, (region, _) in entered.items()}
                team = frozenset(team_of(trace, record, needs[need], at))
                found.setdefault(by.command, []).append(TimedAction(*place, team, takes))
                steps = ((name, *entered.get(name, (-1, 0))) for name in team)
                short |= {(name, step) for name, at, step in steps if at == obstacle.region}
    for timed_actions in found.values():
        timed_actions.sort(key=lambda deed: (deed.takes, deed.obstacle))
    return found, short


def _done(
    team: Mapping[str, Mover],
    timed_actions: Sequence[TimedAction],
    tick: int,
    lasting: float,
    pause: float,
    end: float,
) -> tuple[list[Line], float]:
    """The lines of robots that do one thing after the other, the first after a ``pause``, each for
    ``lasting`` seconds, the last until ``end`` but for rounding; and when they have done it."""
    lines: list[Line] = []
    over = max((mover.time for mover in team.values()), default=0.0)
    for number, deed in enumerate(timed_actions):
        group = [mover for name, mover in team.items() if name in deed.robots]
        for mover in group:
            if number and timed_actions[number - 1].region == mover.region != deed.region:
                lines += mover.resume(tick)
            lines += mover.face(tick, deed.region)
        start = max([over, *(mover.time for mover in group)]) + (0.0 if number else pause)
        over = start + lasting
        if abs(over - end) < SLACK:
            over = end
        for mover in group:
            if mover.time < over:
                lines += mover.rest(tick, over)
            times = (min(start, over), over)
            what = (deed.action, deed.obstacle, deed.region)
            lines.append(Action(mover.robot, tick, *what, *times))
    return lines, over


def _tried(mover: Mover, step: Crossing) -> tuple[float, bool]:
    """Return the end of a step that begins now, and whether it is walked."""
    ahead = copy(mover)
    moved = ahead.move(step)
    return ahead.time, any(isinstance(piece, Segment) for piece in moved)


def _slower(piece: Moving, begin: float, factor: float) -> Moving:
    """The same way, slower by a factor from ``begin`` on."""
    t0, t1 = (begin + (t - begin) * factor for t in (piece.t0, piece.t1))
    if isinstance(piece, Flight):
        curves = tuple(
            Curve(c.seconds * factor, *(_stretched(p, factor) for p in (c.x, c.y, c.z, c.yaw)))
            for c in piece.curves
        )
        return replace(piece, curves=curves, t0=t0, t1=t1)
    assert isinstance(piece, Drive), "a walker rests first"
    arcs = tuple(
        replace(arc, seconds=arc.seconds * factor, way=_stretched(arc.way, factor))
        for arc in piece.arcs
    )
    return replace(piece, arcs=arcs, t0=t0, t1=t1)


def _stretched(polynomial: tuple[float, ...], factor: float) -> tuple[float, ...]:
    return tuple(c / factor**power for power, c in enumerate(polynomial))
