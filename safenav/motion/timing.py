"""The actions of a run with a clock, from its trace; and the conversion of a lockstep run to one
with a clock: each line gets the second at which robots of their paces execute it.

The turns of a run in lockstep are in a serial order in which no robot ever enters a region where
another robot is. In continuous time robots move simultaneously, each at its own pace: a step waits
for earlier ones of robots in conflict (Hoenig et al., RA-L 2019; section VII of the paper names the
problem), and every other line waits for all lines before it. An activity waits only for earlier
ones, so there is no deadlock.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from safenav.motion.file import Motion, MotionHeader
from safenav.pace.robot import Pace, acted_by, pace_of
from safenav.scenario.model import Clock, Need, Obstacle, Robot
from safenav.trace import records
from safenav.trace.file import Trace
from safenav.trace.vocabulary import ActResult, MovedBy, MoveEnd


class TimedAction(Struct, frozen=True):
    """An act of robots on an obstacle in ``region``, part of ``command``, recorded by the
    ``index``-th record of the trace. ``takes``: they carry it from then on."""

    index: int
    command: int
    obstacle: str
    region: int
    action: str
    robots: tuple[str, ...]
    takes: bool


Fulfilling = records.Met | records.Resolved


class Needs:
    """The needs that the lines of a trace fulfil."""

    def __init__(self, obstacles: Mapping[str, Obstacle]) -> None:
        self._obstacles = obstacles
        self._last: set[str] = set()
        """Obstacles whose last need has a line of its own: their resolution follows."""

    def fulfilled(self, record: Fulfilling) -> int | None:
        """Return the number of the need that the next line fulfils; None if the line before has
        recorded that."""
        name, last = record.obstacle, len(self._obstacles[record.obstacle].needs) - 1
        recorded = name in self._last
        self._last.discard(name)
        if isinstance(record, records.Resolved):
            return None if recorded else last
        if record.need == last:
            self._last.add(name)
        return record.need


def actions_of(trace: Trace) -> tuple[list[TimedAction], set[int]]:
    """Return the actions of a run with a clock in the order of its trace, and the commands of steps
    that stop short of such an obstacle in the region that they enter."""
    found: list[TimedAction] = []
    short: set[int] = set()
    obstacles, robots, world = trace.obstacles, trace.robots, trace.header.scenario.map
    at = {name: robot.start.region for name, robot in robots.items()}
    steps: dict[str, int] = {}
    acts = {act.command: act for act, _ in trace.acts}
    ended: dict[tuple[str, int], int] = {}
    needs = Needs(obstacles)
    for index, record in enumerate(trace.records):
        match record:
            case records.Arrive(result=MoveEnd.ARRIVED):
                at[record.robot], steps[record.robot] = record.at, record.command
            case records.ActionEnd() if record.command in acts:
                for name in acts[record.command].robots:
                    ended[name, record.tick] = record.command
            case records.Met() | records.Resolved():
                number = needs.fulfilled(record)
                command = ended.get((record.robot, record.tick))
                if number is None or command is None:
                    continue
                obstacle = obstacles[record.obstacle]
                need, later = obstacle.needs[number], obstacle.needs[number + 1 :]
                regions = obstacle.resolution_regions(world, number)
                team = team_of(robots, record, need, [n for n in at if at[n] in regions])
                what = (obstacle.name, obstacle.region, need.action)
                takes = bool(later and later[0].same)
                found.append(TimedAction(index, command, *what, team, takes))
                inside = (name for name in team if at[name] == obstacle.region)
                short |= {steps[name] for name in inside if name in steps}
    return found, short


def by_command(actions: list[TimedAction]) -> Mapping[int, list[TimedAction]]:
    """Return the actions of each command, those that take a load last."""
    found: dict[int, list[TimedAction]] = {}
    for action in sorted(actions, key=lambda action: (action.takes, action.obstacle)):
        found.setdefault(action.command, []).append(action)
    return found


def team_of(
    robots: Mapping[str, Robot], record: Fulfilling, need: Need, there: Collection[str]
) -> tuple[str, ...]:
    """Return the robots that fulfil a need: the recorded robot, and the others that are able to,
    even without a request. ``there``: the robots in its regions."""
    alone = isinstance(record, records.Met) and not need.together
    others = (n for n in record.robots or () if n in there and not alone)
    able = (n for n in others if need.action in robots[n].capabilities)
    return tuple(dict.fromkeys((record.robot, *able)))


DECIMALS = 9
"""Decimals of seconds: an arrival and the departure after it must not differ by rounding."""


def paces_of(trace: Trace, header: MotionHeader) -> dict[str, Pace]:
    """Return the pace of each robot of a motion, at its start."""
    return {
        name: pace_of(header.robots[name], header.cols, header.side, robot.start.facing)
        for name, robot in trace.robots.items()
    }


def dated(trace: Trace, paces: Mapping[str, Pace]) -> Sequence[records.Record]:
    """Return the lines of a trace as those of a run with a clock, each with its time, in the order
    of the trace."""
    return trace.records if trace.header.live else _walked(trace, paces).lines


def ordered(trace: Trace, lines: Sequence[records.Record]) -> Trace:
    """Return the trace with these lines in the order of their times, at each instant departures
    last, together with robots that go out of service; their ticks stay."""
    if trace.header.live:
        return trace

    def time(line: records.Record) -> tuple[float, bool]:
        out = isinstance(line, records.Service) and not line.active
        return line.t or 0.0, out or isinstance(line, records.Depart)

    return replace(trace, records=tuple(sorted(lines, key=time)))


def in_time(trace: Trace, motion: Motion) -> Trace:
    """Return the trace as that of a live run, whose ticks count its instants; that of a live run
    stays unchanged."""
    return by_instants(ordered(trace, dated(trace, paces_of(trace, motion.header))))


def by_instants(trace: Trace) -> Trace:
    """Return a trace with times as that of a live run, with instants as ticks."""
    if trace.header.live:
        return trace
    found: list[records.Record] = []
    tick, now = 0, 0.0
    for record in trace.records:
        t = record.t or 0.0
        tick, now = tick + (t > now), t
        found.append(replace(record, tick=tick))
    scenario = replace(trace.header.scenario, clock=Clock.LIVE)
    return replace(trace, header=replace(trace.header, scenario=scenario), records=tuple(found))


WAITING = (
    *(records.Request, records.Push, records.Pop, records.Told, records.KnownObstacle),
    *(records.Plan, records.PlanEnd, records.Synthesis, records.Service, records.Truth),
    *(records.Violation, records.Discovered, records.Appeared, records.Gone),
    *(records.Met, records.Resolved),
)
"""Lines that wait for all activities until then, and for which later ones wait: decisions, actions,
and changes of obstacles and robots. Only steps overlap."""


def _parts(trace: Trace) -> Mapping[tuple[str, int], list[Obstacle]]:
    """Return the obstacles of which a robot does its part before others meet the need, by robot
    and tick: no line records that, so it is in the robot's last turn there before the need is met.
    """
    found: dict[tuple[str, int], list[Obstacle]] = defaultdict(list)
    needs, at = Needs(trace.obstacles), {n: r.start.region for n, r in trace.robots.items()}
    last: dict[tuple[str, int], int] = {}
    for record in trace.records:
        match record:
            case records.Move():
                at[record.robot] = record.from_ if record.toward is not None else record.to
                last[record.robot, at[record.robot]] = record.tick
            case records.Met() | records.Resolved():
                obstacle, number = trace.obstacles[record.obstacle], needs.fulfilled(record)
                if number is None:
                    continue
                regions = obstacle.resolution_regions(trace.header.scenario.map, number)
                there = [name for name, region in at.items() if region in regions]
                team = team_of(trace.robots, record, obstacle.needs[number], there)
                for name in set(record.robots or ()) - {*team}:
                    if turns := [last[name, r] for r in regions if (name, r) in last]:
                        found[name, max(turns)].append(obstacle)
    return found


def _walked(trace: Trace, paces: Mapping[str, Pace]) -> _SerialRun:
    run = _SerialRun(trace, paces)
    for record in trace.records:
        run.take(record)
    run.lines = [line for line in run.lines if not isinstance(line, records.Move)]
    return run


class _Step(Struct):
    """A step under way: its index among the lines, its first tick, and its earliest beginning."""

    place: int
    tick: int
    since: float


class _SerialRun:
    """The ``lines`` of a run in lockstep so far, in seconds."""

    def __init__(self, trace: Trace, paces: Mapping[str, Pace]) -> None:
        self._scenario = trace.header.scenario
        self.lines: list[records.Record] = []
        self._robots, self._obstacles, self._paces = trace.robots, trace.obstacles, paces
        self._needs = Needs(self._obstacles)
        self._at = {name: robot.start.region for name, robot in self._robots.items()}
        self._ended: dict[str, float] = defaultdict(float)
        """The end of each robot's last activity."""
        self._left: dict[int, dict[str, float]] = defaultdict(dict)
        """The last step with which each robot left a region."""
        self._parts = _parts(trace)
        self._since = 0.0
        """The time of the last line that is not a step."""
        self._begun: dict[str, _Step] = {}
        """Steps that take several ticks."""
        self._commands = 0
        self._turn = ""

    def take(self, record: records.Record) -> None:
        if isinstance(record, WAITING):
            self._since = max([self._since, *self._ended.values()])
        match record:
            case records.Move():
                self._move(record)
            case records.Met() | records.Resolved():
                number = self._needs.fulfilled(record)
                if number is not None:
                    self._act(record, self._obstacles[record.obstacle], number)
                self._tell(self._since, record)
            case records.End():
                end = max((line.t or 0.0 for line in self.lines), default=0.0)
                self._tell(end, replace(record, makespan=end))
            case _:
                self._tell(max(self._since, self._ended[self._turn]), record)

    def _move(self, move: records.Move) -> None:
        name = self._turn = move.robot
        step = self._begun.pop(name, None)
        if step is None:
            step = _Step(len(self.lines), move.tick, self._since)
            self.lines.append(move)  # this line replaces the departure
        if move.toward is not None:
            self._begun[name] = step
        elif move.to != move.from_:
            self._step(move, step)
        for obstacle in self._parts.get((name, move.tick), ()):
            self._since = max([self._since, *self._ended.values()])
            self._do(move, obstacle, (name,), {})

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
        """Yield the times at which others leave the regions that this robot must not share with
        them: the one that it enters, and those of an exclusion."""
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

    def _act(self, record: Fulfilling, obstacle: Obstacle, number: int) -> None:
        regions = obstacle.resolution_regions(self._scenario.map, number)
        there = [name for name, at in self._at.items() if at in regions]
        team = team_of(self._robots, record, obstacle.needs[number], there)
        self._do(record, obstacle, team, {obstacle.name: ActResult.DONE})

    def _do(
        self,
        record: Fulfilling | records.Move,
        obstacle: Obstacle,
        team: tuple[str, ...],
        results: dict[str, ActResult],
    ) -> None:
        """Let robots act on an obstacle where they are, after all activities until then."""
        begin = self._since
        paces = [(self._paces[name], self._at[name]) for name in team]
        end = self._since = begin + acted_by(paces, begin, obstacle.region)
        self._commands += 1
        who = (self._commands, record.robot)
        self._tell(begin, records.Act(record.tick, *who, team, (obstacle.name,)))
        self._tell(end, records.ActionEnd(record.tick, *who, results))
        self._ended.update(dict.fromkeys(team, end))

    def _tell(self, time: float, record: records.Record) -> None:
        self.lines.append(replace(record, t=round(time, DECIMALS)))
