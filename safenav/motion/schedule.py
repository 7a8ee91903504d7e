"""The times of steps and actions: in lockstep as early as the order of the trace allows, in a run
with a clock those of the trace, where a robot that has less time than it needs is refused.

The turns of a trace are in a serial order in which no robot ever enters a region where another
robot is. In continuous time robots move simultaneously, each at its own pace; only activities that
depend on each other keep the serial order (Hoenig et al., RA-L 2019; section VII of the paper names
the problem). An activity waits only for earlier ones in the trace, so there is no deadlock.

A robot that has more time than its step takes glides or drives more slowly; a walker stands first.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from math import inf

from msgspec import Struct, field
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
from safenav.motion.timing import SHARED, TimedAction, actions_of, by_command, in_conflict
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.setting import ObstacleHeader
from safenav.trace.vocabulary import ChangeCause, MoveEnd

STANDING = 1.0
"""Motion length in seconds for runs without moves."""
SLACK = 1e-6
"""Seconds that are rounding."""


class MotionExecution:
    """The movers of a run, and the ``lines`` of their motion."""

    def __init__(self, movers: Mapping[str, Mover]) -> None:
        self.movers = movers
        self.lines: list[Line] = []
        self._due: set[str] = set()
        """Robots that have acted in their own region, and must resume from there."""

    def step(
        self, robot: str, step: Crossing, begin: float, end: float | None = None
    ) -> tuple[float, float]:
        """Carry out a step from ``begin`` to ``end`` (None: as soon as the robot can). Return its
        start and its earliest end, in seconds."""
        mover = self.movers[robot]
        self._rest(mover, step.tick, begin)
        if end is not None and end > _step_end(mover, step)[0] + SLACK:
            self.lines += mover.halt(step.tick)
            natural, walks = _step_end(mover, step)
            if walks and end > natural + SLACK:
                self.lines += mover.rest(step.tick, mover.time + end - natural)
        begun = mover.time
        moved = mover.move(step)
        natural = mover.time
        if end is not None and end > natural + SLACK:
            factor = (end - begun) / (natural - begun)
            moved = [_slower(piece, begun, factor) for piece in moved]
            mover.time = end
        self.lines += moved
        return max(begin, begun), natural

    def act(
        self,
        robots: Iterable[str],
        actions: Sequence[TimedAction],
        tick: int,
        begin: float,
        end: float | None = None,
    ) -> tuple[tuple[float, str], float]:
        """Carry out actions one after the other from ``begin`` to ``end`` (None: as soon as the
        robots can). Return when the last robot is at rest, that robot, and the end of all, in
        seconds."""
        team = {name: self.movers[name] for name in robots}
        for mover in team.values():
            near = bool(actions) and actions[0].region == mover.region
            self._rest(mover, tick, begin, stays=near and begin < mover.time + SLACK)
            self.lines += mover.halt(tick)
        ready = max((mover.time, name) for name, mover in team.items())
        lasting = max(mover.values.get("action_seconds", 2.0) for mover in team.values())
        pause = 0.0
        if end is not None:
            ahead = {name: copy(mover) for name, mover in team.items()}
            _, natural = _done(ahead, actions, tick, lasting, 0.0, end)
            if actions and natural > end:
                lasting = max(0.0, lasting - (natural - end) / len(actions))
            pause = max(0.0, end - natural)
        lines, over = _done(team, actions, tick, lasting, pause, inf if end is None else end)
        self.lines += lines
        for name, mover in team.items():
            if any(name in act.robots and act.region == mover.region for act in actions):
                self._due.add(name)
            if end is not None:
                self.lines += mover.wait(tick, end)
        return ready, over

    def finish(self, over: float = 0.0) -> tuple[tuple[Line, ...], MotionOutcome]:
        """Let all robots come to rest, and rest until all of them do, at least until ``over``."""
        tick = max((getattr(line, "tick", 0) for line in self.lines), default=0)
        for mover in self.movers.values():
            self._rest(mover, tick, 0.0)
            self.lines += mover.halt(tick)
        until = max([over, *(mover.time for mover in self.movers.values())]) or STANDING
        for mover in self.movers.values():
            self.lines += mover.wait(tick, until)
        return tuple(sorted(self.lines, key=when)), MotionOutcome(until)

    def _rest(self, mover: Mover, tick: int, until: float, *, stays: bool = False) -> None:
        """Rest until then: in the centre of the region, unless the robot ``stays`` where it has
        acted."""
        if mover.robot in self._due and not stays:
            self._due.discard(mover.robot)
            self.lines += mover.resume(tick)
        if until > mover.time + SLACK:
            self.lines += mover.halt(tick)
            self.lines += mover.wait(tick, until)


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
) -> tuple[list[Line], float]:
    """Return the lines of robots that carry out actions one after the other, the first after a
    ``pause``, each for ``lasting`` seconds, the last until ``end`` but for rounding; and when all
    are done."""
    lines: list[Line] = []
    over = max((mover.time for mover in team.values()), default=0.0)
    for number, act in enumerate(actions):
        group = [mover for name, mover in team.items() if name in act.robots]
        for mover in group:
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


def _step_end(mover: Mover, step: Crossing) -> tuple[float, bool]:
    """Return the end of a step that would begin now, and whether it includes walking."""
    ahead = copy(mover)
    moved = ahead.move(step)
    return ahead.time, any(isinstance(piece, Segment) for piece in moved)


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


def motion_at_earliest_times(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[Line, ...], MotionOutcome]:
    """Return the lines of the motion by which these movers, whose time is 0, carry out a trace."""
    actions, short = actions_of(trace)
    run = _SerialRun(trace, trace.obstacles, floor, MotionExecution(movers), short)
    run.execution.lines += [Reserve(n, mover.region, 0.0) for n, mover in movers.items()]
    by_index = {action.index: action for action in actions}
    for index, record in enumerate(trace.records):
        run.take(record, by_index.get(index))
    return run.execution.finish()


class _SerialRun(Struct):
    """The ends of all activities so far, in seconds."""

    trace: Trace
    obstacles: Mapping[str, ObstacleHeader]
    floor: MetricFloor
    execution: MotionExecution
    short: set[tuple[str, int]]
    """Robot and tick of the steps that stop short of an obstacle, which the robot resolves
    there."""
    last: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    """The newest activity of each robot."""
    left: dict[int, dict[str, float]] = field(default_factory=lambda: defaultdict(dict))
    """The last step with which each robot left a region."""
    acted: dict[str, float] = field(default_factory=dict)
    """The newest action on each obstacle."""
    opened: dict[int, list[tuple[frozenset[str], float]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    """Actions that opened a region to the robots that an obstacle had kept out."""
    charged: dict[str, float] = field(default_factory=dict)
    """The action that replaced the battery of a robot, which has not moved since."""
    cause: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    """The decision that each robot follows."""
    decided: float = 0.0
    """The newest decision."""
    planned: tuple[str, ...] = ()
    turn: str | None = None
    begun: dict[str, tuple[int, float]] = field(default_factory=dict)
    """Steps that take several ticks: the first tick, and the decision that they follow."""

    def take(self, record: records.Record, action: TimedAction | None) -> None:
        """Take a line of the trace, and the action that it records, if it records one."""
        match record:
            case records.Move():
                self._move(record)
            case records.Met() | records.Resolved():
                if action is not None:
                    self._act(record, action)
                self._open(record, self.acted[record.obstacle])
            case records.Service(active=True, cause=ChangeCause.BATTERY):
                region = self.execution.movers[record.robot].region
                for _, end in self.opened[region][-1:]:
                    self.charged[record.robot] = end
            case _:
                if isinstance(record, SHARED) and self.turn is not None:
                    self._decide(record, self.turn)

    def _move(self, move: records.Move) -> None:
        name, self.turn = move.robot, move.robot
        now = (move.tick, self.cause[name])
        if move.toward is not None:
            self.begun.setdefault(name, now)
            return
        tick, cause = self.begun.pop(name, now)
        if move.to == move.from_:
            return
        before = [self.last[name], cause, self.charged.pop(name, 0.0)]
        before += self._left_before(name, move.from_, move.to)
        before += [end for kept, end in self.opened[move.to] if name in kept]
        heading = self.floor.heading(move.from_, move.to)
        step = Crossing(tick, move.from_, move.to, heading, (name, tick) in self.short)
        begun, end = self.execution.step(name, step, max(before))
        self.execution.lines += [Reserve(name, step.to, begun), Release(name, step.origin, end)]
        self.last[name] = self.left[move.from_][name] = end

    def _left_before(self, name: str, origin: int, to: int) -> Iterator[float]:
        """Yield when others leave the regions that exclude them while this robot enters one: that
        region; those of an exclusion."""
        scenario = self.trace.header.scenario
        for other in scenario.robots:
            if other == name:
                continue
            regions = {to} if in_conflict(scenario.robots, name, other) else set()
            for zone in scenario.never_together or ():
                entered = to in zone.regions and origin not in zone.regions
                if entered and name in zone.robots and other in zone.robots:
                    regions |= {*zone.regions}
            yield from (self.left[region].get(other, 0.0) for region in regions)

    def _decide(self, record: records.Record, turn: str) -> None:
        self.decided = max(self.decided, self.last[turn])
        if isinstance(record, records.Synthesis):
            self.cause[record.robot] = self.decided
        if isinstance(record, records.Plan):
            self.planned = tuple(record.robots)
        if isinstance(record, records.Plan | records.PlanEnd):
            self.cause.update(dict.fromkeys(self.planned, self.decided))

    def _act(self, record: records.Met | records.Resolved, action: TimedAction) -> None:
        team = action.robots
        start = max([self.decided, *(max(self.last[name], self.cause[name]) for name in team)])
        _, end = self.execution.act(team, (action,), record.tick, start)
        self.acted[action.obstacle] = end
        self.last.update(dict.fromkeys(team, end))

    def _open(self, record: records.Met | records.Resolved, end: float) -> None:
        """Record which robots a region admits: all robots if the obstacle is resolved; if one need
        is left, those that resolve it by entering."""
        obstacle, robots = self.obstacles[record.obstacle], self.trace.header.scenario.robots
        let_in = obstacle.blocks
        if isinstance(record, records.Met):
            if record.need == len(obstacle.needs) - 1:
                return  # its resolution follows
            let_in = frozenset(
                name
                for name in obstacle.blocks & robots.keys()
                if obstacle.resolved_by_entering(robots[name], record.need + 1)
            )
        elif record.traversable is False:
            return
        self.opened[obstacle.region].append((let_in, end))


def motion_at_recorded_times(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[Line, ...], MotionOutcome]:
    """Return the lines of the motion by which these movers, whose time is 0, carry out a trace.
    Raises InputError if they cannot: a step leaves too little time, or a robot changes its region
    without a step."""
    run = _RecordedRun(trace, floor, movers)
    for record in trace.records:
        run.take(record)
    return run.end()


def recorded_reservations(trace: Trace) -> Iterator[Line]:
    """Yield the reservations by the trace alone."""
    for name, robot in trace.header.scenario.robots.items():
        yield Reserve(name, robot.start, 0.0)
    for depart, arrive in trace.steps:
        yield Reserve(depart.robot, depart.to, time_of(depart))
        if arrive is not None and arrive.result is not MoveEnd.LOST:
            left = depart.to if arrive.at == depart.from_ else depart.from_
            yield Release(arrive.robot, left, time_of(arrive))


class _RecordedRun:
    def __init__(self, trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]) -> None:
        self._trace, self._floor, self._movers = trace, floor, movers
        self._execution = MotionExecution(movers)
        self._execution.lines += recorded_reservations(trace)
        actions, self._short = actions_of(trace)
        self._actions = by_command(actions)
        self._departs: dict[str, records.Depart] = {}
        """The steps in progress."""
        self._acts = {act.command: act for act, _ in trace.acts}

    def take(self, record: records.Record) -> None:
        match record:
            case records.Depart():
                self._departs[record.robot] = record
            case records.Arrive():
                self._arrive(self._departs.pop(record.robot), record)
            case records.ActionEnd():
                self._acted(self._acts[record.command], record)

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
        """Carry out a step; at the robot's own pace if the trace does not record its end."""
        heading = self._floor.heading(depart.from_, depart.to)
        short = (depart.robot, depart.command) in self._short
        step = Crossing(depart.tick, depart.from_, depart.to, heading, short)
        return self._execution.step(depart.robot, step, time_of(depart), end)[1]

    def _acted(self, act: records.Act, acted: records.ActionEnd) -> None:
        actions = self._actions.get(acted.command, [])
        idle = self._movers.keys() - self._departs.keys()
        unasked = sorted(idle & {name for one in actions for name in one.robots} - {*act.robots})
        team, end = (*act.robots, *unasked), time_of(acted)
        (ready, name), _ = self._execution.act(team, actions, acted.tick, time_of(act), end)
        if ready > end + SLACK:
            late = f"{name} acts until {end:.2f} s, but comes to rest only at {ready:.2f} s"
            raise self._refused(acted, late)

    def _refused(self, record: records.Record, found: str, hint: str = "") -> InputError:
        return InputError([Diagnostic(self._trace.source, record.line, 1, found, hint)])

    def end(self) -> tuple[tuple[Line, ...], MotionOutcome]:
        for depart in self._departs.values():  # under way when the run ends
            if depart.from_ == self._movers[depart.robot].region:
                self._step(depart, None)
        return self._execution.finish(end_of(self._trace))


def time_of(record: records.Record) -> float:
    """Return the time of a line, in seconds."""
    return record.t or 0.0


def end_of(trace: Trace) -> float:
    """Return the time of the last line of a trace, in seconds."""
    return max(map(time_of, trace.records), default=0.0)
