"""The deadlines of a run: when each begins, and its verdict (docs/deadlines.md).

A listener of the run's records that adds ``deadline`` lines: after each turn for its events, and
before each tick for missed deadlines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.begun import Begun, Done, RoundClock
from safenav.outcome import Outcome
from safenav.runtime.deadline_monitor.moment import goals_left, moment_of, objectives_change
from safenav.runtime.deadlines import bound
from safenav.runtime.duties.requests import OpenRequest
from safenav.runtime.team import Role, TeamState
from safenav.runtime.termination import Conclusion, RunEnded
from safenav.scenario.settings import LatePolicy
from safenav.trace import records
from safenav.trace.vocabulary import DeadlineVerdict
from safenav.trace.wording import Wording
from safenav.world.poses import Mask

MISSION = "mission"
BATTERY = "battery"


class RunningDeadline(Struct, frozen=True):
    """A running deadline. ``due``: the tick at whose end it expires. ``reported``: it was reported
    as lost."""

    due: int
    reported: bool = False
    cause: str | None = None


class Round(Struct):
    """The clock of a robot's rounds. ``disturbed``: in this round the robot did not only pursue its
    objective; ``before``: nor in the previous one. ``over``: this round is already judged, or
    (``reported``) was reported as lost; ``done``: rounds since the last resolution."""

    begun: int = 0
    disturbed: bool = False
    before: bool = False
    over: bool = False
    reported: bool = False
    done: int = 0

    @classmethod
    def continued(cls, clock: RoundClock | None, done: int = 0) -> Round:
        """Return the clock of a round that began before the run (None: it begins with the run)."""
        if clock is None:
            return cls(done=done)
        return cls(-clock.since, clock.disturbed, clock.before, clock.over, done=done)

    @property
    def excused(self) -> bool:
        return self.disturbed or self.before

    def restart(self, tick: int) -> None:
        """Begin another round."""
        self.begun, self.over, self.reported = tick, False, False
        self.before, self.disturbed = self.disturbed, False


class Deadlines(Struct):
    """Keeps the deadlines of a run."""

    team: TeamState
    late: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    _open: dict[str, RunningDeadline] = field(default_factory=dict)
    _rounds: dict[str, Round] = field(default_factory=dict)
    _turn: list[records.Record] = field(default_factory=list)
    _begun: dict[str, int] = field(default_factory=dict)
    _past: dict[str, int] = field(default_factory=dict)
    _had: int = 0
    active: bool = False
    lasts_until: Callable[..., int | None] | None = None
    """The last tick for which a robot's charge lasts behind an obstacle."""

    def __post_init__(self) -> None:
        scenario = self.team.scenario
        self.active = scenario.deadlines
        if scenario.until.by is not None:
            self._open[MISSION] = RunningDeadline(scenario.until.by)
        begun = scenario.begun or Begun()
        self._open |= {of: RunningDeadline(left) for of, left in begun.due.items()}
        self._past |= dict.fromkeys(begun.late, 0)
        for robot in self.team.robots:
            done = begun.robots.get(robot, Done())
            self._rounds[robot] = Round.continued(done.clock, done.rounds)

    def __call__(self, record: records.Record) -> None:
        """Process a record of a turn."""
        if isinstance(record, records.Move):
            if record.toward is None:
                self._begun.pop(record.robot, None)
            else:
                self._begun.setdefault(record.robot, record.tick)
            self._look()
        elif isinstance(record, records.Goal):
            robot = self.team.robots[record.robot]
            if robot.progress is robot.own:
                self._turn.append(record)
        elif isinstance(record, records.NewObjective):
            self._rounds[record.robot] = Round(self.team.tick)  # it begins before the next turn
        elif not isinstance(record, records.Deadline):
            self._turn.append(record)

    def tick_begins(self) -> None:
        """Judge the deadlines of the previous tick. Raises RunEnded."""
        if not self.active:
            return
        self._had, before = 0, self.team.tick - 1
        for of, promise in list(self._open.items()):
            if promise.due <= before:
                del self._open[of]
                self._judge(of, promise.due, DeadlineVerdict.LATE, promise.cause)
        for name, clock in self._rounds.items():
            within = self.team.robots[name].robot.within
            if within is not None and not clock.over and clock.begun + within <= before:
                clock.over = True
                verdict = DeadlineVerdict.EXCUSED if clock.excused else DeadlineVerdict.LATE
                self._judge(name, clock.begun + within, verdict)
        if self.late and self.team.scenario.late is LatePolicy.STOP:
            missed = " and ".join(dict.fromkeys(self.late))
            raise RunEnded(Conclusion(Outcome.LATE, f"a deadline was missed: {missed}"))

    def turn_begins(self, number: int) -> None:
        """Record that robot ``number`` (from 1) has its turn."""
        self._had = number

    def due(self, request: OpenRequest) -> int | None:
        """Return the tick in which a request is due; None without a deadline in ticks. A deadline
        that a charge implies is known from the end of the turn of the request on."""
        if not self.active or self.team.live:
            return None
        of, limit = request.obstacle.name, self.team.scenario.limit_of(request.obstacle)
        if of in self._open:
            return self._open[of].due
        return self._past.get(of, None if limit is None else self.team.tick + limit)

    def turn_ends(self, had_turn: int) -> None:
        """Update all deadlines after a turn, that of robot number ``had_turn`` (from 1)."""
        if not self.active:
            self._turn.clear()
            return
        heard, self._turn = self._turn, []
        for record in heard:
            self._happened(record)
        self._look()
        begins = [r.obstacle for r in heard if isinstance(r, records.Request)]
        if had_turn == len(self.team.robots) or begins:
            self._foresee(had_turn, begins)

    def completed(self) -> None:
        """Record that the mission is completed at the end of this tick; process the remaining
        records."""
        heard, self._turn = self._turn, []
        for record in heard if self.active else ():
            self._happened(record)
        promise = self._open.pop(MISSION, None)
        if promise is not None:
            self._judge(MISSION, promise.due, DeadlineVerdict.KEPT)

    @property
    def missed(self) -> tuple[str, ...] | None:
        """The missed deadlines, each once; None if the scenario has no deadline."""
        return tuple(dict.fromkeys(self.late)) if self.active else None

    def _look(self) -> None:
        """Record the robots that do not pursue their own objective: they wait, help, or are out of
        service."""
        for name, robot in self.team.robots.items():
            away = robot.assignment.role is not Role.OWN or not robot.active
            self._rounds[name].disturbed |= away

    def _happened(self, record: records.Record) -> None:
        tick = self.team.tick
        match record:
            case records.Resolved():
                self._ended(record.obstacle, DeadlineVerdict.KEPT)
                restarts = self.team.scenario.restarts_rounds(record.obstacle)
                for clock in self._rounds.values() if restarts else ():
                    clock.restart(tick)
                    clock.done = 0
            case records.Gone() | records.KnownObstacle():
                self._ended(record.obstacle, DeadlineVerdict.EXCUSED)
            case records.Service(active=True):
                self._rounds[record.robot].restart(tick)
            case records.Goal():
                self._goal(record)

    def _goal(self, record: records.Goal) -> None:
        robot, clock = self.team.robots[record.robot], self._rounds[record.robot]
        if record.round <= clock.done:
            return  # it completes no round
        clock.done = record.round
        within = robot.robot.within
        if within is not None and not clock.over:
            self._judge(record.robot, clock.begun + within, DeadlineVerdict.KEPT)
        clock.restart(record.tick)

    def _ended(self, obstacle: str, verdict: DeadlineVerdict) -> None:
        self._past.pop(obstacle, None)
        promise = self._open.pop(obstacle, None)
        if promise is not None:
            self._judge(obstacle, promise.due, verdict, promise.cause)

    def _judge(self, of: str, due: int, verdict: DeadlineVerdict, cause: str | None = None) -> None:
        if verdict is DeadlineVerdict.LATE:
            self.late.append(of)
            self._past[of] = due
        self.team.emit(records.Deadline(self.team.tick, of, due, verdict, cause=cause))

    def _foresee(self, had_turn: int, begins: list[str]) -> None:
        """Begin the deadlines of new requests, and report all that can no longer be met."""
        fresh = [of for of in dict.fromkeys(begins) if of not in {*self._open, *self._past}]
        wanted = {of: found for of in fresh if (found := self._due(of)) is not None}
        timed = any(robot.robot.within is not None for robot in self.team.robots.values())
        if not (wanted or self._open or timed):
            return
        moment, names = moment_of(self.team, had_turn, self._begun)
        times = bound.earliest(moment)
        ends = {
            name: bound.tick_of(turns[-1], moment.count)
            for name, turns in zip(names, times, strict=True)
        }
        tick = self.team.tick
        for of, (due, cause) in wanted.items():
            self._open[of] = RunningDeadline(due, cause=cause)
            soonest, verdict = ends.get(of, tick), DeadlineVerdict.SET
            self.team.emit(records.Deadline(tick, of, due, verdict, soonest, cause))
        if MISSION in self._open and not objectives_change(self.team):
            rounds = self.team.scenario.until.rounds
            left = (goals_left(self.team, robot, rounds) for robot in self.team.robots.values())
            ends[MISSION] = mission_end(self.team, moment, times, ([goals] for goals in left))
        for of, promise in self._open.items():
            if of in ends and not promise.reported and _beyond(ends[of], promise.due):
                self._open[of] = replace(promise, reported=True)
                self._lost(of, promise.due, ends[of], moment, names)
        for index, (name, robot) in enumerate(self.team.robots.items()):
            clock, within = self._rounds[name], robot.robot.within
            if within is None or clock.over or clock.reported or clock.excused or not robot.active:
                continue
            goals = goals_left(self.team, robot)
            if goals is None or robot.progress is not robot.own:
                continue
            end = bound.rounds_done(moment, index, times, goals)
            soonest = bound.tick_of(end * moment.count, moment.count)
            if _beyond(soonest, clock.begun + within):
                clock.reported = True
                self._lost(name, clock.begun + within, soonest, moment, names)

    def _lost(
        self, of: str, due: int, soonest: int | None, moment: bound.BoundMoment, names: list[str]
    ) -> None:
        lost = DeadlineVerdict.LOST
        line = records.Deadline(self.team.tick, of, due, lost, earliest=soonest)
        self.team.emit(line)
        sentence = Wording(self.team.scenario.map.word).sentence(line)
        why = _nearest(self.team, moment, names.index(of)) if of in names else ""
        self.reasons.append(f"tick {self.team.tick}: {sentence}{why}")

    def _due(self, name: str) -> tuple[int, str | None] | None:
        """Return the due tick of an obstacle: by its limit, or since its requester's charge runs
        out."""
        request = self.team.requests.of(name)
        if request is None:
            return None
        limit = self.team.scenario.limit_of(request.obstacle)
        due = None if limit is None else self.team.tick + limit
        first, until = next(iter(request.requesters), None), None
        if first is not None and self.lasts_until is not None:
            had_turn = [*self.team.robots].index(first) < self._had
            until = self.lasts_until(first, name, had_turn=had_turn)
        if until is not None and (due is None or until < due):
            return until, BATTERY
        return None if due is None else (due, None)


def mission_end(
    team: TeamState,
    moment: bound.BoundMoment,
    times: bound.Times,
    orders: Iterable[Iterable[Sequence[Mask] | None]],
) -> int | None:
    """Return a tick before whose end the mission cannot be completed; None if it never can.
    ``orders``: for each robot the possible sequences of its goals (None: it chooses)."""
    ends = [team.tick]
    for index, choices in enumerate(orders):
        each = (bound.rounds_done(moment, index, times, goals) if goals else 0 for goals in choices)
        ends.append(min(each, default=0))
    return None if max(ends) >= bound.NEVER else max(ends)


def _nearest(team: TeamState, moment: bound.BoundMoment, number: int) -> str:
    """``: digit is 12 steps away``: the nearest of the robots that can fulfil the next need."""
    one = moment.opens[number]
    skills, steps = one.gate.skills[one.stage.need], dict[str, int]()
    for name, walker in zip(team.robots, moment.walkers, strict=True):
        goal = walker.graph.poses_on(one.next.regions)
        found = walker.graph.steps_between(1 << walker.pose, goal, walker.graph.everywhere)
        if skills <= walker.capabilities and found is not None:
            steps[name] = found
    if not steps:
        return ""
    name = min(steps, key=lambda one: (steps[one], one))
    return f": {name} is {steps[name]} step{'s' * (steps[name] != 1)} away"


def _beyond(soonest: int | None, due: int) -> bool:
    return soonest is None or soonest > due
