"""The actions of a run with a clock, from its trace; and the conversion of a lockstep run to a run
with a clock, where each line has the second at which robots with these paces execute it.

In a lockstep run, turns have a serial order, and no robot ever enters another robot's region. In
continuous time robots move simultaneously, each at its own pace. A step waits for earlier ones of
robots in conflict (Hoenig et al., RA-L 2019; section VII of the paper names the problem). Every
other line waits for all lines before it. An activity waits only for earlier ones, so there is no
deadlock.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from safenav.motion.file import Motion, MotionHeader
from safenav.pace.robot import Pace, acted_by, pace_of
from safenav.scenario.model import Clock, Obstacle
from safenav.trace import records
from safenav.trace.file import Trace
from safenav.trace.vocabulary import ActResult, MovedBy, MoveEnd


class TimedAction(Struct, frozen=True):
    """An action of robots on an obstacle in ``region``, as part of a ``command``. ``index``: that
    of the record that reports it; ``takes``: whether the robots then carry the obstacle."""

    index: int
    command: int
    obstacle: str
    region: int
    action: str
    robots: tuple[str, ...]
    takes: bool


Does = records.Part | records.Resolved


class PartDone(Struct, frozen=True):
    """A part of the need with this index, done by the robots of ``team``. Those ``inside`` were in
    the obstacle's region."""

    obstacle: Obstacle
    number: int
    team: tuple[str, ...]
    inside: tuple[str, ...]


def parts_done(trace: Trace) -> dict[int, PartDone]:
    """Return the parts of needs that robots have done, each by the index of its trace line."""
    found: dict[int, PartDone] = {}
    obstacles, at = trace.obstacles, {n: r.start.region for n, r in trace.robots.items()}
    for index, record in enumerate(trace.records):
        match record:
            case records.Arrive(result=MoveEnd.ARRIVED):
                at[record.robot] = record.at
            case records.Move():
                at[record.robot] = record.from_ if record.toward is not None else record.to
            case records.Part() | records.Resolved():
                obstacle = obstacles[record.obstacle]
                if isinstance(record, records.Resolved) and len(obstacle.needs) > 1:
                    continue  # the previous line has recorded the last need
                number = record.need if isinstance(record, records.Part) else 0
                others = (record.robots or ()) if obstacle.needs[number].together else ()
                team = tuple(dict.fromkeys((record.robot, *others)))
                inside = tuple(name for name in team if at[name] == obstacle.region)
                found[index] = PartDone(obstacle, number, team, inside)
    return found


def actions_of(trace: Trace) -> tuple[list[TimedAction], set[int]]:
    """Return the actions of a run with a clock in the order of its trace, and the commands whose
    steps stop short of an obstacle in the entered region, to act on it."""
    found: list[TimedAction] = []
    short: set[int] = set()
    steps: dict[str, int] = {}
    acts = {act.command: act for act, _ in trace.acts}
    ended: dict[tuple[str, int], int] = {}
    done = parts_done(trace)
    for index, record in enumerate(trace.records):
        match record:
            case records.Arrive(result=MoveEnd.ARRIVED):
                steps[record.robot] = record.command
            case records.ActionEnd() if record.command in acts:
                for name in acts[record.command].robots:
                    ended[name, record.tick] = record.command
            case records.Part() | records.Resolved() if index in done:
                one, command = done[index], ended.get((record.robot, record.tick))
                if command is None:
                    continue
                obstacle, (need, *later) = one.obstacle, one.obstacle.needs[one.number :]
                what = (obstacle.name, obstacle.region, need.action)
                takes = bool(later and later[0].same)
                found.append(TimedAction(index, command, *what, one.team, takes))
                short |= {steps[name] for name in one.inside if name in steps}
    return found, short


def by_command(actions: list[TimedAction]) -> Mapping[int, list[TimedAction]]:
    """Return the actions of each command. Those after which robots carry the obstacle come last."""
    found: dict[int, list[TimedAction]] = {}
    carried = {(action.command, action.obstacle): action.takes for action in actions}
    for action in sorted(actions, key=lambda a: (carried[a.command, a.obstacle], a.obstacle)):
        found.setdefault(action.command, []).append(action)
    return found


DECIMALS = 9
"""Decimals of seconds. Rounding must not separate an arrival and the next departure."""


def paces_of(trace: Trace, header: MotionHeader) -> dict[str, Pace]:
    """Return the pace of each robot at the start of a motion."""
    return {
        name: pace_of(robot.model.figures, header.cols, header.side, robot.start.facing)
        for name, robot in trace.robots.items()
    }


def dated(trace: Trace, paces: Mapping[str, Pace]) -> Sequence[records.Record]:
    """Return the lines of a trace in their order, with the times of a run with a clock."""
    if trace.header.live:
        return trace.records
    done = parts_done(trace)
    run = _SerialRun(trace, paces)
    for index, record in enumerate(trace.records):
        run.take(record, done.get(index))
    return [line for line in run.lines if not isinstance(line, records.Move)]


def ordered(trace: Trace, lines: Sequence[records.Record]) -> Trace:
    """Return the trace with these lines in order of time. Departures, actions and changes of
    service are last in each instant. Ticks do not change."""
    if trace.header.live:
        return trace

    def time(line: records.Record) -> tuple[float, bool]:
        return line.t or 0.0, isinstance(line, records.Depart | records.Act | records.Service)

    return replace(trace, records=tuple(sorted(lines, key=time)))


def in_time(trace: Trace, motion: Motion) -> Trace:
    """Convert a trace to a live run's with the times of its motion: a tick is an instant."""
    return by_instants(ordered(trace, dated(trace, paces_of(trace, motion.header))))


def by_instants(trace: Trace) -> Trace:
    """Return a trace with times as a live run's trace, with instants as ticks."""
    if trace.header.live:
        return trace
    found: list[records.Record] = []
    tick, now = 0, 0.0
    for record in trace.records:
        t = record.t or 0.0
        tick, now = tick + (t > now), t
        if isinstance(record, records.Waiting) and (due := record.until) is not None:
            later = (e for e in trace.records if isinstance(e, WAITING) and e.tick >= due)
            record = replace(record, until=next((e.t for e in later), t))
        found.append(replace(record, tick=tick))
    scenario = replace(trace.header.scenario, clock=Clock.LIVE)
    return replace(trace, header=replace(trace.header, scenario=scenario), records=tuple(found))


WAITING = (
    *(records.Request, records.Push, records.Pop, records.Duty, records.KnownObstacle),
    *(records.Plan, records.PlanEnd, records.Synthesis, records.Service, records.Truth),
    *(records.Violation, records.Discovered, records.Appeared, records.Gone),
    *(records.Part, records.Resolved),
)
"""Lines that wait for all earlier activities and delay all later ones: decisions, actions, and
changes of obstacles and robots. Only steps overlap."""


class _Step(Struct):
    """A step in progress: the index of its line, its first tick, and its earliest start."""

    place: int
    tick: int
    since: float


class _SerialRun:
    """A lockstep run that gets times. ``lines``: the lines so far, with times in seconds."""

    def __init__(self, trace: Trace, paces: Mapping[str, Pace]) -> None:
        self._scenario = trace.header.scenario
        self.lines: list[records.Record] = []
        self._robots, self._paces = trace.robots, paces
        self._at = {name: robot.start.region for name, robot in self._robots.items()}
        self._ended: dict[str, float] = defaultdict(float)
        """The end of each robot's last activity."""
        self._left: dict[int, dict[str, float]] = defaultdict(dict)
        """The time at which each robot last left each region."""
        self._since = 0.0
        """The time of the last line that is not a step."""
        self._begun: dict[str, _Step] = {}
        """Steps that take several ticks."""
        self._commands = 0
        self._turn = ""
        self._stood = False
        """Whether the robot that has its turn stands."""

    def take(self, record: records.Record, done: PartDone | None) -> None:
        if isinstance(record, WAITING):
            self._since = max([self._since, *self._ended.values()])
        match record:
            case records.Move():
                self._move(record)
            case records.Part() | records.Resolved():
                if done is not None:
                    self._do(record, done)
                self._tell(self._since, record)
            case records.End():
                end = max((line.t or 0.0 for line in self.lines), default=0.0)
                self._tell(end, replace(record, makespan=end))
            case records.Charge() if self._stood:  # it changes while other robots move
                self._tell(max([self._since, *self._ended.values()]), record)
            case _:
                self._tell(max(self._since, self._ended[self._turn]), record)

    def _move(self, move: records.Move) -> None:
        name = self._turn = move.robot
        self._stood = move.toward is None and move.to == move.from_
        step = self._begun.pop(name, None)
        if step is None:
            step = _Step(len(self.lines), move.tick, self._since)
            self.lines.append(move)  # a placeholder, which the departure replaces
        if move.toward is not None:
            self._begun[name] = step
        elif move.to != move.from_:
            self._step(move, step)

    def _step(self, move: records.Move, step: _Step) -> None:
        name, origin, to = move.robot, move.from_, move.to
        begin = max([self._ended[name], step.since, *self._left_before(name, origin, to)])
        pace = self._paces[name]
        seconds = pace.step(begin, origin, to)
        end = begin + seconds
        pace.arrived(end)
        self._commands += 1
        what = (self._commands, name, origin, to, move.heading, move.by or MovedBy.STRATEGY)
        depart = records.Depart(step.tick, *what, seconds=seconds, t=round(begin, DECIMALS))
        self.lines[step.place] = depart
        self._ended[name] = self._left[origin][name] = end
        self._at[name] = to
        place = (self._commands, name, to, move.heading, MoveEnd.ARRIVED)
        self._tell(end, records.Arrive(move.tick, *place))

    def _left_before(self, name: str, origin: int, to: int) -> Iterator[float]:
        """Yield the times at which other robots left the regions that this robot must not share
        with them: its destination, and the regions of an exclusion that it enters."""
        mine = self._robots[name]
        for other, robot in self._robots.items():
            if other == name:
                continue
            regions = {to} if mine.conflicts(robot) else set()
            for zone in self._scenario.never_together:
                entered = to in zone.regions and origin not in zone.regions
                if entered and zone.robots >= {name, other}:
                    regions |= zone.regions
            yield from (self._left[region].get(other, 0.0) for region in regions)

    def _do(self, record: Does, done: PartDone) -> None:
        """Add the lines of an action of robots on an obstacle, after all earlier activities."""
        begin, team, obstacle = self._since, done.team, done.obstacle
        part = isinstance(record, records.Part) and record.missing
        truth = record.traversable if isinstance(record, records.Resolved) else None
        results = {} if part else {obstacle.name: ActResult.of(truth)}
        paces = [(self._paces[name], self._at[name]) for name in team]
        end = self._since = begin + acted_by(paces, begin, obstacle.region)
        self._commands += 1
        who = (self._commands, record.robot)
        self._tell(begin, records.Act(record.tick, *who, team, (obstacle.name,)))
        self._tell(end, records.ActionEnd(record.tick, *who, results))
        self._ended.update(dict.fromkeys(team, end))

    def _tell(self, time: float, record: records.Record) -> None:
        self.lines.append(replace(record, t=round(time, DECIMALS)))
