"""Times for a run in lockstep: each step and action as early as the order of its trace allows.

The turns of a trace are in a serial order in which nobody ever enters a region where another
robot is. In continuous time robots move simultaneously, each at its own pace; only what depends on
each other keeps the serial order (Hoenig et al., RA-L 2019; section VII of the paper names the
problem). All that an activity waits for is earlier in the trace, so there is no deadlock.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from enum import StrEnum

from msgspec import Struct, field

from safenav.motion.file.records import Action, Link, Wait
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Crossing, Mover
from safenav.pace.robot import AT_ONCE
from safenav.trace import records
from safenav.trace.setting import ExclusionHeader, NeedHeader, ObstacleHeader, RobotHeader
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import ChangeCause

ACTION_SECONDS = "action_seconds"

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
    """A step, an action, or a decision, which takes no time and has no ``team``. It may ``start``
    when the last that it comes ``after`` has ended; its robots, ``free`` since then, have come to
    rest for it when it has ``begun``. ``fulfils``: obstacle, its region and the action."""

    robot: str
    tick: int
    what: str
    team: tuple[str, ...]
    start: float
    begun: float
    end: float
    cause: LinkCause
    after: Activity | None
    free: Mapping[str, float]
    fulfils: tuple[str, int, str] | None = None


Before = tuple[Activity, LinkCause]


def scheduled(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[Activity, ...]:
    """The activities of a run whose robots move so, from time 0; the movers stay as they are."""
    short: set[tuple[str, int]] = set()
    for _ in range(2):  # only the whole run tells which steps end before an obstacle
        run = _Run(trace, floor, {name: copy(m) for name, m in movers.items()}, frozenset(short))
        run.sweeping = tuple(o for o in trace.obstacles.values() if o.sweeps)
        for record in trace.records:
            run.take(record)
        short = run.found_short
    return tuple(run.done)


class _Run(Struct):
    trace: Trace
    floor: MetricFloor
    movers: Mapping[str, Mover]
    short: frozenset[tuple[str, int]]
    """Robot and tick of the steps that end before an obstacle, which the robot resolves there."""
    found_short: set[tuple[str, int]] = field(default_factory=set)
    done: list[Activity] = field(default_factory=list)
    last: dict[str, Activity] = field(default_factory=dict)
    """The newest activity of each robot."""
    left: dict[int, dict[str, Activity]] = field(default_factory=lambda: defaultdict(dict))
    """The step with which each robot left a region last."""
    opened: dict[int, list[tuple[frozenset[str], Activity]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    """Actions that opened a region to those whom an obstacle had kept out."""
    cause: dict[str, Activity] = field(default_factory=dict)
    """The decision that each robot follows."""
    decided: Activity | None = None
    """The newest decision; ``deciding``: more lines may join it."""
    deciding: bool = False
    planned: tuple[str, ...] = ()
    turn: str | None = None
    begun: dict[str, tuple[int, Activity | None]] = field(default_factory=dict)
    """Steps that take several ticks: the first tick, and the decision that they follow."""
    entered: dict[str, tuple[int, int]] = field(default_factory=dict)
    """The region that each robot entered last, and the tick of that step."""
    charged: dict[str, Activity] = field(default_factory=dict)
    """The action that replaced the battery of a robot, which has not moved since."""
    told: dict[str, Activity] = field(default_factory=dict)
    """The action that met the last need of each obstacle that is about to be resolved."""
    outside: dict[int, dict[str, Activity]] = field(default_factory=lambda: defaultdict(dict))
    """The step with which each robot left the regions of an entry of ``never_together`` last."""
    acted: dict[str, Activity] = field(default_factory=dict)
    """The newest action on each obstacle."""
    sweeping: tuple[ObstacleHeader, ...] = ()
    """The obstacles whose resolution sweeps regions."""
    due: set[str] = field(default_factory=set)
    """Robots that have acted in their own region, and have to resume from there."""

    @property
    def robots(self) -> Mapping[str, RobotHeader]:
        return self.trace.header.scenario.robots

    @property
    def zones(self) -> tuple[ExclusionHeader, ...]:
        return self.trace.header.scenario.never_together or ()

    def take(self, record: records.Record) -> None:
        if isinstance(record, records.Move):
            self._move(record)
        elif isinstance(record, records.Met):
            self._met(record)
        elif isinstance(record, records.Resolved):
            self._resolved(record)
        elif isinstance(record, records.Service):
            self._served(record)
        elif isinstance(record, SHARED) and self.turn is not None:
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
        before = self._own(name, cause)
        before += [
            (step, LinkCause.REGION)
            for other, step in self.left[move.to].items()
            if self._conflict(name, other)
        ]
        before += [(act, LinkCause.OBSTACLE) for kept, act in self.opened[move.to] if name in kept]
        before += [*self._alone(name, move.from_, move.to), *self._not_swept(name, move.to)]
        if (replaced := self.charged.pop(name, None)) is not None:
            before.append((replaced, LinkCause.OBSTACLE))
        heading = self.floor.heading(move.from_, move.to)
        short = (name, tick) in self.short
        step = Crossing(tick, move.from_, move.to, heading, short)
        done = self.left[move.from_][name] = self._do(name, tick, (name,), before, step)
        self.entered[name] = move.to, tick
        for number, zone in enumerate(self.zones):
            if move.from_ in zone.regions and move.to not in zone.regions:
                self.outside[number][name] = done

    def _alone(self, name: str, origin: int, to: int) -> Iterator[Before]:
        """The steps with which others have left regions where at most one robot may be."""
        for number, zone in enumerate(self.zones):
            if name in zone.robots and to in zone.regions and origin not in zone.regions:
                for other, step in self.outside[number].items():
                    if other != name and other in zone.robots:
                        yield step, LinkCause.REGION

    def _not_swept(self, name: str, to: int) -> Iterator[Before]:
        """The activities of others that keep robots out of regions that an action sweeps: their
        steps out of swept regions before a robot enters the obstacle there, their actions and steps
        away from it before a robot enters the swept regions."""
        for obstacle in self.sweeping:
            sweeps = obstacle.sweeps or ()
            if to == obstacle.region:
                yield from self._left(sweeps, (name,))
            if to in sweeps:
                yield from self._left((obstacle.region,), (name,))
                if (act := self.acted.get(obstacle.name)) is not None:
                    yield act, LinkCause.OBSTACLE

    def _left(self, regions: Iterable[int], team: tuple[str, ...]) -> Iterator[Before]:
        """The steps with which robots other than these have left regions."""
        for region in regions:
            for other, step in self.left[region].items():
                if other not in team:
                    yield step, LinkCause.REGION

    def _own(self, name: str, cause: Activity | None) -> list[Before]:
        before = [] if name not in self.last else [(self.last[name], LinkCause.OWN)]
        return before if cause is None else [*before, (cause, LinkCause.SYNTHESIS)]

    def _conflict(self, robot: str, other: str) -> bool:
        mine, theirs = self.robots[robot], self.robots[other]
        if robot == other or mine.conflicts is None or theirs.conflicts is None:
            return robot != other and mine.layer == theirs.layer
        return other in mine.conflicts or robot in theirs.conflicts

    def _decide(self, record: records.Record, turn: str) -> None:
        if self.decided is None or not self.deciding:
            before = self._own(turn, self.decided)
            self.decided, self.deciding = self._do(turn, record.tick, (), before, None), True
        if isinstance(record, records.Synthesis):
            self.cause[record.robot] = self.decided
        if isinstance(record, records.Plan):
            self.planned = tuple(record.robots)
        if isinstance(record, records.Plan | records.PlanEnd):
            self.cause.update(dict.fromkeys(self.planned, self.decided))

    def _met(self, record: records.Met) -> None:
        """The action that fulfils one of several needs. Robots that resolve the rest by entering
        are let in."""
        obstacle = self.trace.obstacles[record.obstacle]
        act = self._act(record, obstacle, record.need)
        if record.need == len(obstacle.all_needs) - 1:
            self.told[obstacle.name] = act
            return
        let_in = frozenset(
            name
            for name in obstacle.blocks & self.robots.keys()
            if obstacle.resolved_by_entering(self.robots[name], record.need + 1)
        )
        self._open(obstacle, let_in, act)

    def _resolved(self, record: records.Resolved) -> None:
        obstacle = self.trace.obstacles[record.obstacle]
        act = self.told.pop(obstacle.name, None)
        if act is None:
            act = self._act(record, obstacle, len(obstacle.all_needs) - 1)
        if record.traversable is not False:
            self._open(obstacle, obstacle.blocks, act)

    def _served(self, record: records.Service) -> None:
        """A robot without charge moves again when its battery was replaced."""
        if record.active and record.cause is ChangeCause.BATTERY:
            region, _ = self.entered.get(record.robot, (self.robots[record.robot].start, 0))
            for _, act in self.opened[region][-1:]:
                self.charged[record.robot] = act

    def _open(self, obstacle: ObstacleHeader, to: frozenset[str], act: Activity) -> None:
        self.opened[obstacle.region].append((to, act))

    def _act(
        self, record: records.Met | records.Resolved, obstacle: ObstacleHeader, number: int
    ) -> Activity:
        need = obstacle.all_needs[number]
        at = {name: mover.region for name, mover in self.movers.items()}
        team = tuple(team_of(self.trace, record, need, at))
        before = self._own(record.robot, self.cause.get(record.robot))
        for name in team[1:]:
            links = self._own(name, self.cause.get(name))
            before += [(link, LinkCause.TOGETHER) for link, _ in links]
        if self.decided is not None:
            before.append((self.decided, LinkCause.SYNTHESIS))
        before += self._left(obstacle.sweeps or (), team)
        self.deciding = False
        act = (obstacle.name, obstacle.region, need.action)
        for name in team:
            region, tick = self.entered.get(name, (-1, 0))
            if region == obstacle.region and name not in self.begun:
                self.found_short.add((name, tick))
        done = self._do(record.robot, record.tick, team, before, act)
        self.acted[obstacle.name] = done
        return done

    def _do(
        self,
        robot: str,
        tick: int,
        team: tuple[str, ...],
        before: Sequence[Before],
        what: Crossing | tuple[str, int, str] | None,
    ) -> Activity:
        """An activity after all of those before; its last is the robot's own of those that end
        together."""
        free = {name: self.last[name].end if name in self.last else 0.0 for name in team}
        ready = max((activity.end for activity, _ in before), default=0.0)
        near = [link for link in before if link[0].end >= ready - AT_ONCE]
        after, cause = max(
            near, key=lambda link: link[1] is LinkCause.OWN, default=(None, LinkCause.OWN)
        )
        start = max([ready, *free.values()])
        movers = [self.movers[name] for name in team]
        for mover in movers:
            stays = isinstance(what, tuple) and what[1] == mover.region
            if mover.robot in self.due and not (stays and start <= mover.time + AT_ONCE):
                self.due.discard(mover.robot)
                mover.resume(0)
            if not isinstance(what, Crossing) or start > mover.time + AT_ONCE:
                _rest(mover, start)
        begun = end = max([start, *(mover.time for mover in movers)])
        words = ""
        if isinstance(what, Crossing):
            words = f"{what.origin} -> {what.to}"
            movers[0].move(what)
            end = movers[0].time
        elif what is not None:
            words = f"{what[2]} {what[0]}"
            end = _acted(movers, what[1])
            self.due |= {mover.robot for mover in movers if mover.region == what[1]}
        act = what if isinstance(what, tuple) else None
        done = Activity(robot, tick, words, team, start, begun, end, cause, after, free, act)
        self.done.append(done)
        self.last.update(dict.fromkeys(team, done))
        return done


def team_of(
    trace: Trace, record: records.Met | records.Resolved, need: NeedHeader, at: Mapping[str, int]
) -> Iterator[str]:
    """The robots that meet a need: who is named, and of the others those who can, also unasked.
    ``at``: where each robot is."""
    yield record.robot
    robots = trace.header.scenario.robots
    alone = isinstance(record, records.Met) and not need.together
    for name in () if alone else record.robots or ():
        able = at[name] in need.regions and need.action in robots[name].capabilities
        if able and name != record.robot:
            yield name


def _acted(team: Sequence[Mover], region: int) -> float:
    for mover in team:
        mover.face(0, region)
    lasting = max(float(mover.values.get(ACTION_SECONDS, 2.0)) for mover in team)
    end = max(mover.time for mover in team) + lasting
    for mover in team:
        mover.rest(0, end)
    return end


def _rest(mover: Mover, until: float) -> None:
    mover.halt(0)
    if mover.time < until:
        mover.rest(0, until)


def steps_of(done: Iterable[Activity]) -> dict[tuple[str, int], tuple[float, float]]:
    """Return the start and end of each step, by robot and tick."""
    return {(a.robot, a.tick): (a.begun, a.end) for a in done if a.team and a.fulfils is None}


def actions_of(done: Iterable[Activity]) -> Iterator[Action]:
    """The actions, each from when its robots may come to rest for it."""
    for activity in done:
        for name in activity.team if activity.fulfils is not None else ():
            assert activity.fulfils is not None
            obstacle, region, action = activity.fulfils
            times = (activity.start, activity.end)
            yield Action(name, activity.tick, action, obstacle, region, *times)


def waits_of(done: Iterable[Activity]) -> Iterator[Wait]:
    for activity in done:
        for name, since in activity.free.items():
            after = activity.after
            if after is not None and activity.start > since + AT_ONCE:
                times = (since, activity.start, activity.cause)
                yield Wait(name, activity.tick, *times, after.robot, after.tick)


def chain_of(done: Iterable[Activity], makespan: float) -> tuple[Link, ...]:
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
