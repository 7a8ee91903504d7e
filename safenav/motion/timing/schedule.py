"""The times of steps and actions: in lockstep as early as the order of the trace allows, in a run
with a clock those of the trace, where a robot that has less time than it needs is refused.

The turns of a trace are in a serial order in which no robot ever enters a region where another
robot is. In continuous time robots move simultaneously, each at its own pace; only activities that
depend on each other keep the serial order (Hoenig et al., RA-L 2019; section VII of the paper names
the problem). An activity waits only for earlier ones in the trace, so there is no deadlock.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import StrEnum

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.motion.file import Line, Link, MotionOutcome, Wait
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Crossing, Mover
from safenav.motion.timing.execution import (
    SLACK,
    MotionExecution,
    ReservationLedger,
    TimedAction,
    actions_of,
    by_command,
    in_conflict,
    when,
)
from safenav.pace.robot import AT_ONCE
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.setting import ObstacleHeader, RobotHeader
from safenav.trace.vocabulary import ChangeCause, MoveEnd

SHARED = (
    *(records.Request, records.Push, records.Pop, records.Told, records.KnownObstacle),
    *(records.Plan, records.PlanEnd, records.Synthesis),
)
"""Lines of decisions that concern more than one robot."""


class LinkCause(StrEnum):
    """Reason for the order of two steps or actions."""

    OWN = "own"
    """The robot itself did that before."""
    REGION = "region"
    """The other robot left the region that this one enters."""
    OBSTACLE = "obstacle"
    """It resolved an obstacle that was in the way."""
    SYNTHESIS = "synthesis"
    """A decision of that moment made the robot's present strategy or plan."""
    TOGETHER = "together"
    """The action takes several robots."""


class Activity(Struct, frozen=True):
    """A step, an action, or a decision, which takes no time and has no ``team``. It may start when
    the activity ``after`` which it comes has ended; ``free``: when each robot was ready for it."""

    robot: str
    tick: int
    what: str
    team: tuple[str, ...]
    start: float
    end: float
    cause: LinkCause
    after: Activity | None
    free: Mapping[str, float]


Before = tuple[Activity, LinkCause]


def motion_at_earliest_times(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[Line, ...], MotionOutcome]:
    """Return the lines of the motion by which these movers, whose time is 0, carry out a trace:
    with waits and the critical path."""
    ledger = ReservationLedger({name: mover.region for name, mover in movers.items()})
    actions, short = actions_of(trace)
    run = _Run(trace, floor, MotionExecution(movers, ledger), ledger, short, trace.obstacles)
    by_index = {action.index: action for action in actions}
    for index, record in enumerate(trace.records):
        run.take(record, by_index.get(index))
    lines, outcome = run.execution.finish()
    waits = [*_waits(run.done)]
    waiting = dict.fromkeys(movers, 0.0)
    for wait in waits:
        waiting[wait.robot] += wait.t1 - wait.t0
    outcome = replace(outcome, waiting=waiting, chain=_chain(run.done, outcome.makespan))
    return tuple(sorted([*lines, *waits], key=when)), outcome


class _Run(Struct):
    trace: Trace
    floor: MetricFloor
    execution: MotionExecution
    ledger: ReservationLedger
    short: set[tuple[str, int]]
    """Robot and tick of the steps that stop short of an obstacle, which the robot resolves
    there."""
    obstacles: Mapping[str, ObstacleHeader]
    done: list[Activity] = field(default_factory=list)
    last: dict[str, Activity] = field(default_factory=dict)
    """The newest activity of each robot."""
    left: dict[int, dict[str, Activity]] = field(default_factory=lambda: defaultdict(dict))
    """The last step with which each robot left a region."""
    acted: dict[str, Activity] = field(default_factory=dict)
    """The newest action on each obstacle."""
    opened: dict[int, list[tuple[frozenset[str], Activity]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    """Actions that opened a region to the robots that an obstacle had kept out."""
    charged: dict[str, Activity] = field(default_factory=dict)
    """The action that replaced the battery of a robot, which has not moved since."""
    cause: dict[str, Activity] = field(default_factory=dict)
    """The decision that each robot follows."""
    decided: Activity | None = None
    """The newest decision; ``deciding``: more lines may join it."""
    deciding: bool = False
    planned: tuple[str, ...] = ()
    turn: str | None = None
    begun: dict[str, tuple[int, Activity | None]] = field(default_factory=dict)
    """Steps that take several ticks: the first tick, and the decision that they follow."""

    @property
    def robots(self) -> Mapping[str, RobotHeader]:
        return self.trace.header.scenario.robots

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
                for _, act in self.opened[region][-1:]:
                    self.charged[record.robot] = act
            case _:
                if isinstance(record, SHARED) and self.turn is not None:
                    self._decide(record, self.turn)

    def _move(self, move: records.Move) -> None:
        name, self.turn, self.deciding = move.robot, move.robot, False
        now = (move.tick, self.cause.get(name))
        if move.toward is not None:
            self.begun.setdefault(name, now)
            return
        tick, cause = self.begun.pop(name, now)
        if move.to == move.from_:
            return
        before = [*self._own(name, cause), *self._left_before(name, move.from_, move.to)]
        acts = [act for kept, act in self.opened[move.to] if name in kept]
        acts += [self.charged.pop(name)] if name in self.charged else []
        before += [(act, LinkCause.OBSTACLE) for act in acts]
        heading = self.floor.heading(move.from_, move.to)
        step = Crossing(tick, move.from_, move.to, heading, (name, tick) in self.short)

        def crossed(start: float) -> float:
            begun, end = self.execution.step(name, step, start)
            self.ledger.reserve(name, tick, step.to, begun)
            self.ledger.release(name, move.tick, step.origin, end)
            self.ledger.busy((name,), begun, end)
            return end

        what = f"{move.from_} -> {move.to}"
        self.left[move.from_][name] = self._do(name, tick, (name,), before, what, crossed)

    def _left_before(self, name: str, origin: int, to: int) -> Iterator[Before]:
        """Yield the steps by which others leave the regions that exclude them while this robot
        enters one: that region; those of an exclusion."""
        for other in self.robots:
            if other == name:
                continue
            regions = {to} if in_conflict(self.robots, name, other) else set()
            for zone in self.trace.header.scenario.never_together or ():
                entered = to in zone.regions and origin not in zone.regions
                if entered and name in zone.robots and other in zone.robots:
                    regions |= {*zone.regions}
            yield from self._left((other,), regions)

    def _left(self, robots: Iterable[str], regions: Iterable[int]) -> Iterator[Before]:
        """The steps with which robots have left regions."""
        for name in robots:
            steps = (self.left[region].get(name) for region in regions)
            yield from ((step, LinkCause.REGION) for step in steps if step is not None)

    def _own(self, name: str, cause: Activity | None) -> list[Before]:
        before = [] if name not in self.last else [(self.last[name], LinkCause.OWN)]
        return before if cause is None else [*before, (cause, LinkCause.SYNTHESIS)]

    def _decide(self, record: records.Record, turn: str) -> None:
        if self.decided is None or not self.deciding:
            before = self._own(turn, self.decided)
            self.decided, self.deciding = self._do(turn, record.tick, (), before), True
        if isinstance(record, records.Synthesis):
            self.cause[record.robot] = self.decided
        if isinstance(record, records.Plan):
            self.planned = tuple(record.robots)
        if isinstance(record, records.Plan | records.PlanEnd):
            self.cause.update(dict.fromkeys(self.planned, self.decided))

    def _act(self, record: records.Met | records.Resolved, action: TimedAction) -> None:
        team = action.robots
        before = self._own(record.robot, self.cause.get(record.robot))
        for name in team[1:]:
            links = self._own(name, self.cause.get(name))
            before += [(link, LinkCause.TOGETHER) for link, _ in links]
        if self.decided is not None:
            before.append((self.decided, LinkCause.SYNTHESIS))
        self.deciding = False

        def acted(start: float) -> float:
            _, end = self.execution.act(team, (action,), record.tick, start)
            self.ledger.busy(team, start, end)
            return end

        what = f"{action.action} {action.obstacle}"
        done = self._do(record.robot, record.tick, team, before, what, acted)
        self.acted[action.obstacle] = done

    def _open(self, record: records.Met | records.Resolved, act: Activity) -> None:
        """Record which robots a region admits: all robots if the obstacle is resolved; if one need
        is left, those that resolve it by entering."""
        obstacle = self.obstacles[record.obstacle]
        let_in = obstacle.blocks
        if isinstance(record, records.Met):
            if record.need == len(obstacle.needs) - 1:
                return  # its resolution follows
            let_in = frozenset(
                name
                for name in obstacle.blocks & self.robots.keys()
                if obstacle.resolved_by_entering(self.robots[name], record.need + 1)
            )
        elif record.traversable is False:
            return
        self.opened[obstacle.region].append((let_in, act))

    def _do(
        self,
        robot: str,
        tick: int,
        team: tuple[str, ...],
        before: Sequence[Before],
        what: str = "",
        carry_out: Callable[[float], float] = lambda start: start,
    ) -> Activity:
        """Record an activity after all those in ``before``. It is ``after`` the last of them, of
        several that end together the robot's own. ``carry_out``: returns its end for its start."""
        free = {name: self.last[name].end if name in self.last else 0.0 for name in team}
        ready = max((activity.end for activity, _ in before), default=0.0)
        near = [link for link in before if link[0].end >= ready - AT_ONCE]
        after, cause = max(
            near, key=lambda link: link[1] is LinkCause.OWN, default=(None, LinkCause.OWN)
        )
        start = max([ready, *free.values()])
        end = carry_out(start)
        done = Activity(robot, tick, what, team, start, end, cause, after, free)
        self.done.append(done)
        self.last.update(dict.fromkeys(team, done))
        return done


def _waits(done: Iterable[Activity]) -> Iterator[Wait]:
    for activity in done:
        for name, since in activity.free.items():
            after = activity.after
            if after is not None and activity.start > since + AT_ONCE:
                times = (since, activity.start, activity.cause)
                yield Wait(name, activity.tick, *times, after.robot, after.tick)


def _chain(done: Iterable[Activity], makespan: float) -> tuple[Link, ...]:
    """The links from the start to the end, each beginning when the one before ends."""
    found: list[Link] = []
    last = max((a for a in done if a.team), key=lambda a: a.end, default=None)
    if last is not None and last.end < makespan:
        found.append(Link(last.robot, last.tick, "stop", last.end, makespan, LinkCause.OWN))
    while last is not None:
        if last.team:
            found.append(Link(last.robot, last.tick, last.what, last.start, last.end, last.cause))
        last = last.after
    return tuple(reversed(found))


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


class TraceLedger(ReservationLedger):
    """A ledger by the trace alone. ``departs``: the steps in progress."""

    def __init__(self, starts: Mapping[str, int]) -> None:
        super().__init__(starts)
        self.departs: dict[str, records.Depart] = {}
        self._acts: dict[int, records.Act] = {}

    def step(self, record: records.Record) -> tuple[records.Depart, records.Arrive] | None:
        """Take a line of the trace; return the step that it ends, if it ends one."""
        if isinstance(record, records.Depart):
            self.departs[record.robot] = record
            self.reserve(record.robot, record.tick, record.to, _time(record))
        if not isinstance(record, records.Arrive):
            return None
        depart = self.departs.pop(record.robot)
        left = depart.to if record.at == depart.from_ else depart.from_
        if record.result is not MoveEnd.LOST:
            self.release(record.robot, record.tick, left, _time(record))
        self.busy((record.robot,), _time(depart), _time(record))
        return depart, record

    def action(self, record: records.Record) -> tuple[records.Act, records.ActionEnd] | None:
        """Take a line of the trace; return the action that it ends, if it ends one."""
        if isinstance(record, records.Act):
            self._acts[record.command] = record
        if not isinstance(record, records.ActionEnd):
            return None
        act = self._acts.pop(record.command)
        self.busy(act.robots, _time(act), _time(record))
        return act, record


class _RecordedRun:
    def __init__(self, trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]) -> None:
        self._trace, self._floor, self._movers = trace, floor, movers
        self._ledger = TraceLedger({name: mover.region for name, mover in movers.items()})
        self._execution = MotionExecution(movers, self._ledger)
        actions, self._short = actions_of(trace)
        self._actions = by_command(actions)

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
            found = f"{name} departs from region {depart.from_}, but was in region {region}"
            raise self._refused(depart, f"{found}: no motion shows how it came there")
        if arrive.at != depart.to:
            found = f"{name} was sent to region {depart.to}, but arrives in region {arrive.at}"
            raise self._refused(arrive, f"{found}: no motion shows how it came there")
        begin, end = _time(depart), _time(arrive)
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
        return self._execution.step(depart.robot, step, _time(depart), end)[1]

    def _acted(self, act: records.Act, acted: records.ActionEnd) -> None:
        actions = self._actions.get(acted.command, [])
        idle = self._movers.keys() - self._ledger.departs.keys()
        unasked = sorted(idle & {name for one in actions for name in one.robots} - {*act.robots})
        team, end = (*act.robots, *unasked), _time(acted)
        (ready, name), _ = self._execution.act(team, actions, acted.tick, _time(act), end)
        if ready > end + SLACK:
            late = f"{name} acts until {end:.2f} s, but comes to rest only at {ready:.2f} s"
            raise self._refused(acted, late)

    def _refused(self, record: records.Record, found: str, hint: str = "") -> InputError:
        return InputError([Diagnostic(self._trace.source, record.line, 1, found, hint)])

    def end(self) -> tuple[tuple[Line, ...], MotionOutcome]:
        for depart in self._ledger.departs.values():  # under way when the run ends
            if depart.from_ == self._movers[depart.robot].region:
                self._step(depart, None)
        return self._execution.finish(max(map(_time, self._trace.records), default=0.0))


def _time(record: records.Record) -> float:
    return record.t or 0.0
