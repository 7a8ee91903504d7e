"""The state in which a trace ends: where the robots are, and what they have done of their
objectives. The rest of the run begins there (``runtime.analysis.resuming``).
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct, field

from safenav.begun import Begun, Done, PlanLeft, RoundClock
from safenav.outcome import Outcome
from safenav.runtime.analysis.memories import Memories
from safenav.runtime.deadline_monitor.ledger import Round
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.model import name_parts
from safenav.scenario.objective import Ltl, Objective, station
from safenav.trace import records, setting, vocabulary
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.told_objective import objective_of
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import (
    ChangeCause,
    DeadlineVerdict,
    HoldReason,
    MovedBy,
    OperatorIntervention,
)
from safenav.world.moves import Pose

CHANGES = (
    *(records.Push, records.Pop, records.Told, records.Synthesis, records.NewObjective),
    *(records.Resolved, records.KnownObstacle, records.Met, records.Service, records.PlanEnd),
    *(records.Gone, records.Appeared),
)
"""Lines after which robots may have other targets."""


class Pursued(Struct):
    """A robot's own objective, ``within`` so many ticks a round, and its progress with it.
    ``begun``: what it meets counts; ``memories``: those of its formulas, if it has any."""

    objective: TracedObjective
    within: int | None = None
    begun: bool = False
    rounds: int = 0
    seen: set[int] = field(default_factory=set)
    turn: int = 0
    clock: Round = field(default_factory=Round)
    memories: Memories | None = None

    @property
    def pursuit(self) -> Objective:
        """The objective itself; of an unknown kind, no targets count."""
        return objective_of(self.objective) or Ltl()

    def meet(self, goal: records.Goal) -> None:
        """Count a goal."""
        known, counted = self.pursuit, goal.round > self.rounds
        self.begun, self.rounds = True, goal.round
        self.seen.add(goal.goal)
        if counted or (known.settles and self.rounds):  # it stays where it has met all
            self.seen.clear()
        if counted:
            self.clock.restart(goal.tick)
        if known.in_turn:
            last = len(known.targets) - 1
            ahead = min(goal.goal + 1, last) if known.settles else (goal.goal + 1) % (last + 1)
            self.turn = ahead

    def stay(self, region: int) -> None:
        """Count a turn that ends in a region: a tick where the robot settles has no line."""
        if self.begun and self.pursuit.stays(self.turn, region):
            self.rounds += 1
        self.begun = True

    def recount(self, tick: int) -> None:
        """Count rounds from a resolution on."""
        self.rounds = 0
        self.seen.clear()
        self.clock.restart(tick)


class TraceEnd(Struct):
    """The end of a trace. ``in_force``: the objective that each robot pursues; ``chosen``: the
    inputs that a user has set; ``due``: the ticks in which open requests are due, ``late``: those
    that were; ``closed``: the obstacles that were found untraversable;
    ``asked``: the requests that are open or given up, each with where its requesters wait;
    ``stays``: the obstacles of which an operator says that they stay, ``given_up``: those that no
    robot can resolve as things stood; ``backs_up``: the robot and the obstacle from which it does;
    ``plan``: the joint plan that is followed, with the steps that each robot has ``taken``, or the
    one of the header that is ``to_follow``;
    ``had``: the robots that have had their turn in the last tick, ``had_before``: those of tick 1
    that had it in the run before;
    ``away``: those that an input keeps from their objective; ``inputs``: the last two ticks in
    which inputs changed, and their values then; ``arrived``: when robots with formulas did, or
    began with a known memory there; ``flat``: the type of obstacle of robots without charge;
    ``moved``: the robot whose turn it is, and where it is, until its goal is counted; ``stayed``:
    it was there before; ``since``: the tick since which each robot stands with the same target."""

    poses: dict[str, Pose]
    own: dict[str, Pursued]
    in_force: dict[str, TracedObjective]
    out: set[str] = field(default_factory=set)
    gone: set[str] = field(default_factory=set)
    appeared: set[str] = field(default_factory=set)
    truths: dict[str, bool | None] = field(default_factory=dict)
    met: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    chosen: dict[str, bool] = field(default_factory=dict)
    due: dict[str, int] = field(default_factory=dict)
    late: set[str] = field(default_factory=set)
    closed: set[str] = field(default_factory=set)
    asked: dict[str, dict[str, int]] = field(default_factory=dict)
    stays: set[str] = field(default_factory=set)
    given_up: set[str] = field(default_factory=set)
    backs_up: tuple[str, str] | None = None
    flat: str | None = None
    moved: tuple[str, int] | None = None
    stayed: bool = False
    since: dict[str, int] = field(default_factory=dict)
    plan: PlanLeft | None = None
    taken: dict[str, int] = field(default_factory=dict)
    to_follow: bool = False
    had: set[str] = field(default_factory=set)
    had_before: frozenset[str] = frozenset()
    away: set[str] = field(default_factory=set)
    inputs: tuple[tuple[int, Mapping[str, bool]], ...] = ()
    arrived: dict[str, float] = field(default_factory=dict)
    ran: bool = False
    live: bool = False
    continues: bool = False
    time: float = 0.0

    @property
    def begins(self) -> float:
        """The time before the first tick of the rest: a tick in which some robots have had no turn
        yet, or a goal is not counted yet, is not over."""
        over = len(self.had) == len(self.poses) and not self._is_owed_goal()
        return self.time if over or self.live or not self.time else self.time - 1

    def _is_owed_goal(self) -> bool:
        """Whether the robot that has moved last has met a target that is not counted yet."""
        if self.moved is None or not self.pursues(self.moved[0]):
            return False
        own, region = self.own[self.moved[0]], self.moved[1]
        known = own.pursuit
        counted = own.rounds or self.stayed
        if known.stays(own.turn, region) and counted:
            return False  # its next ticks have no lines
        return bool({*known.met(own.turn, region)} - own.seen)

    @classmethod
    def of(cls, trace: Trace) -> TraceEnd:
        """Return the state after all lines of a trace."""
        header, robots = trace.header.scenario, trace.header.scenario.robots
        end = cls(
            {name: Pose.of(robot.start, robot.heading) for name, robot in robots.items()},
            {name: _pursued(name, header) for name in robots},
            {name: robot.objective for name, robot in robots.items()},
            flat=header.flat,
        )
        if header.begun is not None:
            end.continues, end.ran = True, header.begun.ran
            end.due, end.late = dict(header.begun.due), {*header.begun.late}
            end.closed, end.stays = {*header.begun.closed}, {*header.begun.stays}
            end._plans(header.begun.plan)
            end.to_follow = True
            end.had_before = frozenset(header.begun.had)
            end.since = {name: 1 - age for name, age in header.begun.waited.items()}
            end.asked = {name: {**robots} for name, robots in header.begun.asked.items()}
            end.met = {name: [*groups] for name, groups in header.begun.met.items()}
        for record in trace.records:
            end.take(record)
        end.look()
        return end

    def take(self, record: records.Record) -> None:
        """Follow a line."""
        if record.tick and isinstance(record, CHANGES):
            self.since = dict.fromkeys(self.own, record.tick)
        elif record.tick and isinstance(record, records.Goal):
            self.since[record.robot] = record.tick
        if record.t is None and record.tick != self.time:
            self.had.clear()
        self.live = record.t is not None
        self.ran |= record.tick > 0 and not isinstance(record, records.End)
        self.time = record.t if record.t is not None else record.tick
        match record:
            case records.Violation():
                self._encountered(record)
            case records.Move():
                self._sets_out()
                self.look()
                self._turn_over()
                self.had.add(record.robot)
                if self.backs_up is not None and record.robot == self.backs_up[0]:
                    self._waits(record.to if record.toward is None else record.toward)
                if record.toward is None:
                    pose = Pose.of(record.to, record.heading)
                    self._step(record.robot, pose, decided=record.by is MovedBy.STRATEGY)
                    if not (record.tick == 1 and record.robot in self.had_before):
                        self.moved = record.robot, record.to  # else it has had its turn
            case records.Arrive():
                self._step(record.robot, Pose.of(record.at, record.heading), decided=False)
                self.moved = record.robot, record.at
                if self.backs_up is not None and record.robot == self.backs_up[0]:
                    self._waits(record.at)
            case records.Depart() | records.Held():
                if isinstance(record, records.Depart):
                    self._sets_out()
                    self._stood(record.robot, self.time > self.arrived.get(record.robot, 0.0))
                elif record.why is HoldReason.STRATEGY:
                    self._stood(record.robot, long=True)
                self.moved = None
                if self.backs_up is not None and record.robot == self.backs_up[0]:
                    here = self.poses[record.robot].region
                    self._waits(record.to if isinstance(record, records.Depart) else here)
            case records.Operator() if record.intervention is OperatorIntervention.PERMANENT:
                self._forget(record.obstacle or "")
                self.stays.add(record.obstacle or "")
            case records.Operator() if record.robot is not None and record.region is not None:
                self.poses[record.robot] = Pose.of(record.region, record.heading)
            case records.Plan():
                self._plans(record)
                self.to_follow = False
            case records.PlanEnd():
                self.plan = None
            case records.Push() | records.Pop():
                self.in_force |= record.objectives
            case records.Told():
                self.in_force[record.robot] = record.objective
            case records.Synthesis() if record.node is not None:  # it was installed
                memories = self.own[record.robot].memories
                if memories is not None and record.memory and record.region is not None:
                    memories.choose(record.memory, record.region, self.poses[record.robot].region)
                    self.arrived[record.robot] = self.time
                if record.places is None:
                    self.in_force[record.robot] = record.objective
                    self._turned(record)
            case records.NewObjective():
                self._given(record)
            case records.Goal() if self.pursues(record.robot):
                self.own[record.robot].meet(record)
                self.moved = None
            case records.Inputs():
                self.inputs = *self.inputs[-1:], (record.tick, record.values)
                self.chosen = {name: record.values[name] for name in record.user or ()}
            case records.Resolved():
                if record.traversable is not False:
                    self.gone.add(record.obstacle)
                else:
                    self.closed.add(record.obstacle)
                self._forget(record.obstacle)
                restarts = name_parts(record.obstacle)[0] != self.flat
                for pursued in self.own.values() if restarts else ():
                    pursued.recount(record.tick)
                self._over(record.obstacle)
            case records.Truth():
                self.truths[record.obstacle] = record.traversable
            case records.Gone():
                self.gone.add(record.obstacle)
                self.closed.discard(record.obstacle)
                self._forget(record.obstacle)
                self._over(record.obstacle)
            case records.KnownObstacle():
                self._over(record.obstacle)
                self.given_up.add(record.obstacle)
            case records.Reopened():
                self.given_up.discard(record.obstacle)
            case records.Appeared():
                if record.tick > 1 or not self.continues:  # else it has appeared before
                    self.met.pop(record.obstacle, None)
                self.gone.discard(record.obstacle)
                self.closed.discard(record.obstacle)
                self._forget(record.obstacle)
                self.appeared.add(record.obstacle)
            case records.Met():
                groups = self.met.setdefault(record.obstacle, [])
                groups.append(record.robots or (record.robot,))
            case records.Service():
                if record.active:
                    self.own[record.robot].clock.restart(record.tick)
                if record.cause is not ChangeCause.BATTERY:
                    (self.out.discard if record.active else self.out.add)(record.robot)
            case records.Deadline():
                self._judged(record)
            case _:
                pass

    def _step(self, robot: str, pose: Pose, *, decided: bool) -> None:
        """Follow a step, or a turn in which a robot stays. ``decided``: by its strategy."""
        before, self.poses[robot] = self.poses[robot], pose
        self.stayed = before.region == pose.region
        if not self.stayed:
            self.since[robot] = round(self.time)
        if self.plan is not None and pose != before:
            ahead = self.plan.robots[robot][self.taken[robot] + 1 :]
            self.taken[robot] += bool(ahead) and Pose.of(*ahead[0]) == pose
        memories = self.own[robot].memories
        if memories is not None and robot not in self.away and (decided or pose != before):
            tick = self.time if not self.live else 0
            then = [values for at, values in self.inputs if at < tick]
            now = [values for _, values in self.inputs]
            given = ({}, {}) if self.live else ((then or [{}])[-1], (now or [{}])[-1])
            memories.step(before, pose, given)
            self.arrived[robot] = self.time

    def _stood(self, robot: str, long: bool) -> None:
        """Note that a robot has stood where it is. ``long``: since it has arrived there."""
        memories = self.own[robot].memories
        if memories is not None and robot not in self.away:
            memories.stood(self.poses[robot], long=long)

    def look(self) -> None:
        """Note which robots do something else than their own objective."""
        for name, pursued in self.own.items():
            pursued.clock.disturbed |= not self.pursues(name) or name in self.out

    def _plans(self, plan: records.Plan | PlanLeft | None) -> None:
        """Follow a joint plan from now on."""
        self.plan = None if plan is None else PlanLeft(plan.robots, plan.orders, plan.reason)
        self.taken = dict.fromkeys(self.own, 0)

    def _sets_out(self) -> None:
        """Forget the plan of the header if no robot follows it."""
        if self.to_follow:
            self.plan, self.to_follow = None, False

    def _left(self) -> PlanLeft | None:
        """The rest of the joint plan; None where a robot has left it, or all have arrived."""
        if self.plan is None or self.plan.robots.keys() != self.own.keys():
            return None
        left = {name: way[self.taken[name] :] for name, way in self.plan.robots.items()}
        if all(len(way) == 1 for way in left.values()):
            return None
        for name, way in left.items():
            here = self.poses[name]
            if len(way) == 1:  # it may have left it
                left[name] = (here.place,)
            elif Pose.of(*way[0]) != here:
                return None
        orders = (
            (first, i - self.taken[first], then, j - self.taken[then])
            for first, i, then, j in self.plan.orders
        )
        to_come = tuple(order for order in orders if order[1] > 0 and order[3] > 0)
        return PlanLeft(left, to_come, self.plan.reason)

    def _waited(self) -> dict[str, int]:
        """The ticks for which robots have stood with the same target, but where they are to be."""
        ages = {name: round(self.begins) + 1 - self.since.get(name, 1) for name in self.own}
        return {name: age for name, age in ages.items() if age > 0 and not self._stays(name)}

    def _stays(self, robot: str) -> bool:
        """Whether a robot is where it is to stay."""
        there = station(objective_of(self.in_force[robot]) or Ltl())
        return there is not None and self.poses[robot].region in there

    def _turn_over(self) -> None:
        """Count the turn that is over."""
        if self.moved is not None and self.pursues(self.moved[0]):
            self.own[self.moved[0]].stay(self.moved[1])
        self.moved = None

    def pursues(self, robot: str) -> bool:
        """Return whether a robot pursues its own objective."""
        return self.in_force[robot] == self.own[robot].objective

    def begun(self, trace: Trace, *, timed: bool) -> Begun:
        """Return what the rest of the run continues. ``timed``: it has deadlines."""
        tick = round(self.begins) if timed else 0
        charging = tuple(name for name in self.own if self._charges(name, trace.header))
        robots = {
            name: Done(
                own.rounds,
                tuple(sorted(own.seen)),
                own.turn,
                name not in charging and self._is_uncounted(name),
                self._clock(name, tick) if timed else None,
                {} if own.memories is None else own.memories.likeliest,
            )
            for name, own in self.own.items()
            if own.begun or (own.memories is not None and own.memories.begun)
        }
        due = {of: max(0, at - tick) for of, at in self.due.items()} if timed else {}
        late = tuple(sorted(self.late)) if timed else ()
        had = tuple(sorted(self.had)) if self.begins < self.time else ()
        closed = tuple(sorted(self.closed))
        stays = tuple(sorted(self.stays))
        return Begun(
            trace.digest or None,
            robots,
            due,
            late,
            closed,
            had,
            asked=self.asked,
            stays=stays,
            plan=self._left(),
            waited={} if self.live else self._waited(),
            charging=charging,
            ran=self.ran,
        )

    def _charges(self, robot: str, header: records.Header) -> bool:
        """Whether a robot charges where it stands: it is to stay there, not for a request."""
        here, chargers = self.poses[robot].region, header.scenario.chargers or ()
        waits = any(here == waits.get(robot) for waits in self.asked.values())
        charges = header.scenario.robots[robot].battery is not None and here in chargers
        return charges and not self.pursues(robot) and not waits and self._stays(robot)

    def _clock(self, robot: str, tick: int) -> RoundClock:
        """The clock of a round at a tick; one that is due by then is due at the start."""
        if robot in self.away:  # another round begins when it is back, be it in tick 1
            return RoundClock(-1)
        own = self.own[robot]
        clock, since = own.clock, tick - own.clock.begun
        if own.within is not None and not clock.over:
            since = min(since, own.within)
        return RoundClock(since, clock.disturbed, clock.before, clock.over)

    def _is_uncounted(self, robot: str) -> bool:
        """Whether what a robot meets where it stands is not counted yet: its turn was not over, it
        did something else, or its next target is there, too, which its strategy takes as met."""
        own, region = self.own[robot], self.poses[robot].region
        moves = self.moved is not None and self.moved[0] == robot
        if not self.pursues(robot) or not own.begun:
            return True
        known = own.pursuit
        if not known.in_turn or (known.stays(own.turn, region) and not moves):
            return moves
        return bool(known.met(own.turn, region))

    def _given(self, record: records.NewObjective) -> None:
        robot, own = record.robot, self.own[record.robot]
        if record.at_once:
            self.in_force[robot] = record.objective
        if record.cause is ChangeCause.INPUT:  # until it changes again
            same = record.objective == own.objective
            (self.away.discard if same else self.away.add)(robot)
            own.rounds, own.begun, own.clock = 0, True, Round(record.tick)
            own.seen.clear()
        else:
            clock = Round(record.tick)
            self.own[robot] = Pursued(record.objective, record.within, clock=clock)

    def _turned(self, record: records.Synthesis) -> None:
        """Note that a strategy begins with another target than the one whose turn it was."""
        if record.form is vocabulary.Form.OTHER_MEMORY and self.pursues(record.robot):
            self.own[record.robot].turn = next(iter((record.memory or {"": 0}).values()))

    def _encountered(self, record: records.Violation) -> None:
        """Note a request; obstacles that are known to stay are not requested."""
        name, robot = record.obstacle, record.robot
        if name not in self.closed | self.stays | self.given_up:
            requesters = self.asked.setdefault(name, {})
            requesters.pop(robot, None)
            requesters[robot] = self.poses[robot].region
            self.backs_up = robot, name

    def _waits(self, here: int) -> None:
        """Note where a robot that has backed up from an obstacle waits."""
        assert self.backs_up is not None
        robot, name = self.backs_up
        self.backs_up = None
        if robot in self.asked.get(name, ()):
            self.asked[name][robot] = here

    def _forget(self, obstacle: str) -> None:
        """Note that an obstacle is no longer there as the team knew it."""
        self.asked.pop(obstacle, None)
        self.stays.discard(obstacle)
        self.given_up.discard(obstacle)

    def _over(self, obstacle: str) -> None:
        """Note that no request for an obstacle is due from here on."""
        self.due.pop(obstacle, None)
        self.late.discard(obstacle)

    def _judged(self, record: records.Deadline) -> None:
        if record.verdict is DeadlineVerdict.LOST:
            return
        if record.of in self.own:
            self.own[record.of].clock.over |= record.verdict is not DeadlineVerdict.KEPT
        elif record.verdict is DeadlineVerdict.SET:
            if record.cause is None:  # a charge is computed again
                self.due[record.of] = record.due
        else:
            self.due.pop(record.of, None)
            if record.verdict is DeadlineVerdict.LATE:
                self.late.add(record.of)


def ended_late(trace: Trace) -> bool:
    """Return whether a missed deadline ended the run."""
    return trace.outcome is not None and trace.outcome.outcome is Outcome.LATE


def _pursued(name: str, header: setting.ScenarioHeader) -> Pursued:
    """The progress of a robot with which a trace begins."""
    within = {} if header.promises is None else header.promises.within
    own = Pursued(header.robots[name].objective, within.get(name))
    done = None if header.begun is None else header.begun.robots.get(name)
    if done is not None:
        own.begun, own.rounds, own.seen, own.turn = True, done.rounds, {*done.seen}, done.turn
        own.clock = Round.continued(done.clock)
    if isinstance(own.pursuit, Ltl) and own.pursuit.memory:
        start = Pose.of(header.robots[name].start, header.robots[name].heading)
        own.memories = Memories.at_start(guarantees_of(own.pursuit), start)
        if done is not None and done.memory:
            own.memories.possible, own.memories.begun = [done.memory], True
    return own
