"""The actions of a run by its trace, in lockstep or live; and a run in lockstep as a run in time:
each line of its trace at the second of its motion.

The lines of each robot keep their order, as do those of each obstacle. A story at these times
agrees with the bodies at every instant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.motion.file import (
    Action,
    Motion,
    Moving,
)
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.setting import NeedHeader, ObstacleHeader, RobotHeader
from safenav.trace.vocabulary import ActResult, ChangeCause, MovedBy, MoveEnd


class TimedAction(Struct, frozen=True):
    """An act of robots on an obstacle in ``region``, recorded by the ``index``-th record of the
    trace; of a live run, part of ``command``. ``takes``: they carry it from then on."""

    index: int
    command: int
    obstacle: str
    region: int
    action: str
    robots: tuple[str, ...]
    takes: bool


def actions_of(trace: Trace) -> tuple[list[TimedAction], set[tuple[str, int]]]:
    """Return the actions in the order of the trace, and the steps that stop short of such an
    obstacle in the region that they enter: robot, and the command or, in lockstep, the first
    tick."""
    found: list[TimedAction] = []
    short: set[tuple[str, int]] = set()
    obstacles, lockstep = trace.obstacles, trace.header.clock is None
    at = {name: robot.start for name, robot in trace.header.scenario.robots.items()}
    begun: dict[str, int] = {}
    steps: dict[str, int] = {}
    acts: dict[int, records.Act] = {}
    ended: dict[tuple[str, int], int] = {}
    last: set[str] = set()
    for index, record in enumerate(trace.records):
        match record:
            case records.Move(toward=None):
                step = begun.pop(record.robot, record.tick)
                if record.to != record.from_:
                    at[record.robot], steps[record.robot] = record.to, step
            case records.Move():
                begun.setdefault(record.robot, record.tick)
            case records.Arrive(result=MoveEnd.ARRIVED):
                at[record.robot], steps[record.robot] = record.at, record.command
            case records.Act():
                acts[record.command] = record
            case records.ActionEnd():
                for name in acts[record.command].robots:
                    ended[name, record.tick] = record.command
            case records.Met() | records.Resolved():
                obstacle = obstacles[record.obstacle]
                needs = obstacle.needs
                number = record.need if isinstance(record, records.Met) else len(needs) - 1
                resolved = isinstance(record, records.Resolved) and obstacle.name in last
                last.discard(obstacle.name)
                if isinstance(record, records.Met) and number == len(needs) - 1:
                    last.add(obstacle.name)
                command = ended.get((record.robot, record.tick), 0 if lockstep else None)
                if resolved or command is None:
                    continue
                takes = number + 1 < len(needs) and bool(needs[number + 1].same)
                team = team_of(trace, record, needs[number], at)
                what = (obstacle.name, obstacle.region, needs[number].action)
                found.append(TimedAction(index, command, *what, team, takes))
                inside = (n for n in team if at[n] == obstacle.region and n not in begun)
                short |= {(name, steps[name]) for name in inside if name in steps}
            case _:
                pass
    return found, short


def by_command(actions: list[TimedAction]) -> Mapping[int, list[TimedAction]]:
    """The actions of each command, those that take a load last."""
    found: dict[int, list[TimedAction]] = {}
    for action in sorted(actions, key=lambda action: (action.takes, action.obstacle)):
        found.setdefault(action.command, []).append(action)
    return found


def team_of(
    trace: Trace, record: records.Met | records.Resolved, need: NeedHeader, at: Mapping[str, int]
) -> tuple[str, ...]:
    """The robots that fulfil a need: the recorded robot, and the others that are able to, even
    without a request. ``at``: where each robot is."""
    robots = trace.header.scenario.robots
    alone = isinstance(record, records.Met) and not need.together
    others = (n for n in record.robots or () if at[n] in need.regions and not alone)
    able = (n for n in others if need.action in robots[n].capabilities)
    return tuple(dict.fromkeys((record.robot, *able)))


def in_conflict(robots: Mapping[str, RobotHeader], one: str, other: str) -> bool:
    """Whether two robots must never share a region."""
    mine, theirs = robots[one], robots[other]
    if one == other or mine.conflicts is None or theirs.conflicts is None:
        return one != other and mine.layer == theirs.layer
    return other in mine.conflicts or one in theirs.conflicts


SHARED = (
    *(records.Request, records.Push, records.Pop, records.Told, records.KnownObstacle),
    *(records.Plan, records.PlanEnd, records.Synthesis),
)
"""Lines of decisions that concern more than one robot."""

MOTION = "motion"
"""The clock of a run in lockstep whose lines have the seconds of its motion; the numbers in its
lines still count ticks."""
DECIMALS = 9
"""Decimals of seconds: an arrival and the departure after it must not differ by rounding."""


Dated = tuple[float, records.Record]


def dated(trace: Trace, motion: Motion) -> list[Dated]:
    """Return the lines of a trace as those of a run with a clock, each with its time, in the order
    of the trace; in lockstep also its moves, as turns."""
    if trace.header.clock is not None:
        return [(record.t or 0.0, record) for record in trace.records]
    return _walked(trace, motion).dated


def in_time(trace: Trace, motion: Motion) -> Trace:
    """Return the trace as that of a run with a clock, ``MOTION``; one with a clock stays
    unchanged."""
    return ordered(trace, dated(trace, motion))


def ordered(trace: Trace, lines: list[Dated]) -> Trace:
    """Return the trace with these lines in the order of their times."""
    if trace.header.clock is not None:
        return trace
    found: list[records.Record] = []
    tick, now = 0, 0.0
    timed = (line for line in lines if not isinstance(line[1], records.Move))
    for time, record in sorted(timed, key=lambda line: line[0]):
        tick, now = tick + (time > now), time
        found.append(replace(record, t=time, tick=tick))
    return replace(trace, header=replace(trace.header, clock=MOTION), records=tuple(found))


def turns_in_time(trace: Trace, motion: Motion) -> Mapping[str, Sequence[tuple[int, float]]]:
    """The turns of each robot of a run in lockstep: tick, and the second at which its activities
    until then had ended, ascending."""
    return _walked(trace, motion).turns


def _walked(trace: Trace, motion: Motion) -> _Run:
    steps: dict[tuple[str, int], tuple[float, float]] = {}
    for line in motion.of(Moving):
        if line.origin != line.to:
            begin, _ = steps.get((line.robot, line.tick), (line.t0, 0.0))
            steps[line.robot, line.tick] = begin, line.t1
    run = _Run(trace.obstacles, steps, motion.of(Action), motion.outcome.makespan)
    for record in trace.records:
        run.take(record)
    return run


class _Run(Struct):
    obstacles: Mapping[str, ObstacleHeader]
    steps: Mapping[tuple[str, int], tuple[float, float]]
    actions: list[Action]
    makespan: float
    dated: list[Dated] = field(default_factory=list)
    ended: dict[str, float] = field(default_factory=dict)
    """The end of each robot's last activity so far."""
    turn: str = ""
    since: dict[str, float] = field(default_factory=dict)
    """The last time of each obstacle."""
    due: dict[str, tuple[float, float, records.Record]] = field(default_factory=dict)
    """Obstacles that appear or disappear: the earliest time, and the time without a later line."""
    left: dict[int, float] = field(default_factory=dict)
    """When each region was left last."""
    under_way: dict[str, tuple[int, float]] = field(default_factory=dict)
    """Command and end of a step that takes several ticks."""
    decided: float = 0.0
    """The time of the last decision that concerned more than one robot."""
    commands: int = 0
    at: dict[str, int] = field(default_factory=dict)
    """Region in which each robot last came to rest."""
    turns: dict[str, list[tuple[int, float]]] = field(default_factory=dict)

    def take(self, record: records.Record) -> None:
        now = self.ended.get(self.turn, 0.0)
        match record:
            case records.Move():
                self._move(record)
            case records.Violation():
                self.turn = record.robot
                self._about(record.obstacle, self.ended.get(record.robot, 0.0), record)
            case records.Met() | records.Resolved():
                self._deed(record)
            case records.Appeared(cause=ChangeCause.BATTERY):
                region = self.obstacles[record.obstacle].region
                there = [self.ended[name] for name, at in self.at.items() if at == region]
                self._about(record.obstacle, max(there, default=0.0), record)
            case records.Service(cause=ChangeCause.BATTERY):
                region = self.at.get(record.robot, -1)
                past = [t for o, t in self.since.items() if self.obstacles[o].region == region]
                self._tell(max([self.ended.get(record.robot, 0.0), *past]), record)
            case records.Appeared() if self.obstacles[record.obstacle].ordered:
                self._about(record.obstacle, max(now, self.decided), record)  # as its request
            case records.Appeared():
                left = self.left.get(self.obstacles[record.obstacle].region, 0.0)
                self._due(record.obstacle, left, record)
            case records.Gone():
                self._due(record.obstacle, 0.0, record)
            case records.Discovered():
                self._about(record.obstacle.name, now, record)
            case records.Truth():
                self._about(record.obstacle, now, record)
            case records.End():
                for obstacle in [*self.due]:
                    self._settle(obstacle, inf)
                end = max([self.makespan, *(t for t, _ in self.dated)])
                self._tell(end, replace(record, makespan=end))
            case _:
                if isinstance(record, SHARED):
                    now = self.decided = max(now, self.decided)
                self._tell(now, record)

    def _move(self, move: records.Move) -> None:
        name, self.turn = move.robot, move.robot
        self._tell(self.ended.get(name, 0.0), move)
        step = None if name in self.under_way else self.steps.get((name, move.tick))
        if step is not None:
            self.commands += 1
            to = move.to if move.toward is None else move.toward
            fields = (
                self.commands,
                name,
                move.from_,
                to,
                move.heading,
                move.by or MovedBy.STRATEGY,
            )
            depart = records.Depart(move.tick, *fields, seconds=step[1] - step[0])
            for obstacle in [o for o in self.due if self.obstacles[o].region == to]:
                self._settle(obstacle, step[0])
            self._tell(step[0], depart)
            self.under_way[name] = self.commands, step[1]
        if move.toward is None and name in self.under_way:
            command, end = self.under_way.pop(name)
            self.ended[name] = self.left[move.from_] = end
            self.at[name] = move.to
            place = (command, name, move.to, move.heading, MoveEnd.ARRIVED)
            self._tell(end, records.Arrive(move.tick, *place))
        self._turned(name, move.tick, self.ended.get(name, 0.0))

    def _turned(self, name: str, tick: int, time: float) -> None:
        turns = self.turns.setdefault(name, [])
        turns.append((tick, max(round(time, DECIMALS), turns[-1][1] if turns else 0.0)))

    def _deed(self, record: records.Met | records.Resolved) -> None:
        mine = (record.robot, record.obstacle, record.tick)
        first = next((a for a in self.actions if (a.robot, a.obstacle, a.tick) == mine), None)
        if first is None:  # the line of its last need has recorded it
            self._about(record.obstacle, self.since.get(record.obstacle, 0.0), record)
            return
        span = (first.obstacle, first.t0, first.t1)
        team = [a for a in self.actions if (a.obstacle, a.t0, a.t1) == span]
        self.actions = [a for a in self.actions if a not in team]
        self.commands += 1
        names = tuple(action.robot for action in team)
        act = records.Act(record.tick, self.commands, first.robot, names, (first.obstacle,))
        self._tell(first.t0, act)
        done = {first.obstacle: ActResult.DONE}
        self._tell(first.t1, records.ActionEnd(record.tick, self.commands, first.robot, done))
        for name in names:
            self.ended[name] = max(self.ended.get(name, 0.0), first.t1)
        self.decided = max(self.decided, first.t1)
        self._about(record.obstacle, first.t1, record)
        for name in names:
            self._departs_later(name)
        for name in [n for n, at in self.at.items() if at == first.region]:
            self._turned(name, record.tick, first.t1)

    def _departs_later(self, name: str) -> None:
        """Let a robot that has acted in a tick of its step depart after the action."""
        if name in self.under_way:
            mine = (i for i, (_, record) in enumerate(self.dated) if _departs(record, name))
            self.dated.append(self.dated.pop(max(mine)))

    def _due(self, obstacle: str, least: float, record: records.Record) -> None:
        """Let an obstacle appear or disappear once all activities until then have ended, at least
        at a time; earlier if the next line about it, or a step into its region, comes first."""
        self._settle(obstacle, inf)
        least = max(least, self.since.get(obstacle, 0.0))
        self.due[obstacle] = least, max([least, *self.ended.values()]), record

    def _settle(self, obstacle: str, latest: float) -> None:
        if obstacle in self.due:
            least, time, record = self.due.pop(obstacle)
            self._about(obstacle, max(least, min(time, latest)), record)

    def _about(self, obstacle: str, time: float, record: records.Record) -> None:
        self._settle(obstacle, time)
        self.since[obstacle] = max(time, self.since.get(obstacle, 0.0))
        self._tell(self.since[obstacle], record)

    def _tell(self, time: float, record: records.Record) -> None:
        self.dated.append((round(time, DECIMALS), record))


def _departs(record: records.Record, name: str) -> bool:
    return isinstance(record, records.Depart) and record.robot == name
