"""The state in which a trace ends: the robots' poses, and the progress with their objectives. The
rest of the run begins there (``runtime.analysis.resuming``).
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct, field

from safenav.begun import Begun, Done, RoundClock
from safenav.outcome import Outcome
from safenav.runtime.analysis.obstacles_end import ObstaclesEnd
from safenav.runtime.analysis.pursued import FollowedPlan, Pursued
from safenav.runtime.deadline_monitor.ledger import Round
from safenav.scenario.model import name_parts
from safenav.scenario.objective import Ltl, station
from safenav.trace import records, vocabulary
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.reading import Trace
from safenav.trace.told_objective import objective_of
from safenav.trace.vocabulary import ChangeCause, DeadlineVerdict, HoldReason, MovedBy
from safenav.world.moves import Pose

CHANGES = (
    *(records.Push, records.Pop, records.Told, records.Synthesis, records.NewObjective),
    *(records.Resolved, records.KnownObstacle, records.Met, records.Service, records.PlanEnd),
    *(records.Gone, records.Appeared),
)
"""Lines after which robots may have other targets."""


class TraceEnd(Struct):
    """The end of a trace. ``in_force``: the objective that each robot pursues; ``chosen``: the
    inputs that a user has set; ``plan``: the joint plan that is followed; ``had``: the robots that
    have had their turn in the last tick; ``had_before``: those that had their turn of tick 1 in the
    earlier run, with all goals counted; ``away``: those that an input keeps from their objective;
    ``inputs``: the last two ticks in which inputs changed, with their values; ``arrived``: the
    times at which robots with formulas arrived, or began with a known memory; ``flat``: the
    obstacle type of robots with an empty battery; ``moved``: the robot whose turn it is and its
    region, until its goal is counted; ``stayed``: it was there before; ``since``: the tick since
    which each robot stands with the same target."""

    poses: dict[str, Pose]
    own: dict[str, Pursued]
    in_force: dict[str, TracedObjective]
    out: set[str] = field(default_factory=set)
    chosen: dict[str, bool] = field(default_factory=dict)
    obstacles: ObstaclesEnd = field(default_factory=ObstaclesEnd)
    flat: str | None = None
    moved: tuple[str, int] | None = None
    stayed: bool = False
    since: dict[str, int] = field(default_factory=dict)
    plan: FollowedPlan = field(default_factory=FollowedPlan)
    had: set[str] = field(default_factory=set)
    had_before: frozenset[str] = frozenset()
    away: set[str] = field(default_factory=set)
    inputs: tuple[tuple[int, Mapping[str, bool]], ...] = ()
    arrived: dict[str, float] = field(default_factory=dict)
    ran: bool = False
    live: bool = False
    time: float = 0.0

    @property
    def begins(self) -> float:
        """The time before the first tick of the rest. A tick is not over while some robot has not
        had its turn, or a goal is not counted."""
        over = len(self.had) == len(self.poses) and not self._is_owed_goal()
        return self.time if over or self.live or not self.time else self.time - 1

    def _is_owed_goal(self) -> bool:
        """Whether the robot that moved last has met a target that is not counted yet."""
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
            {name: Pursued.at_start(name, header) for name in robots},
            {name: robot.objective for name, robot in robots.items()},
            obstacles=ObstaclesEnd.of(header.begun),
            flat=header.flat,
        )
        if header.begun is not None:
            end.ran, done = header.begun.ran, header.begun.robots
            counted = {name for name, one in done.items() if not one.uncounted}
            end.had_before = frozenset(counted.intersection(header.begun.had))
            end.plan.begin(header.begun.plan, to_follow=True)
            end.since = {name: 1 - age for name, age in header.begun.waited.items()}
        for record in trace.records:
            end.take(record)
        end.look()
        return end

    def take(self, record: records.Record) -> None:
        """Process a line."""
        if record.tick and isinstance(record, CHANGES):
            self.since = dict.fromkeys(self.own, record.tick)
        elif record.tick and isinstance(record, records.Goal):
            self.since[record.robot] = record.tick
        if record.t is None and record.tick != self.time:
            self.had.clear()
        self.live = record.t is not None
        self.ran |= record.tick > 0 and not isinstance(record, records.End)
        self.time = record.t if record.t is not None else record.tick
        self.obstacles.take(record, self.poses)
        self._moved(record)
        self._changed(record)

    def _moved(self, record: records.Record) -> None:
        """Record the robots' poses, and whose turn it is."""
        match record:
            case records.Move():
                self.plan.sets_out()
                self.look()
                self._turn_over()
                self.had.add(record.robot)
                self.obstacles.waits(
                    record.robot, record.to if record.toward is None else record.toward
                )
                if record.toward is None:
                    pose = Pose.of(record.to, record.heading)
                    self._step(record.robot, pose, decided=record.by is MovedBy.STRATEGY)
                    if not (record.tick == 1 and record.robot in self.had_before):
                        self.moved = record.robot, record.to  # otherwise it has had its turn
            case records.Arrive():
                self._step(record.robot, Pose.of(record.at, record.heading), decided=False)
                self.moved = record.robot, record.at
                self.obstacles.waits(record.robot, record.at)
            case records.Depart():
                self.plan.sets_out()
                self._stood(record.robot, self.time > self.arrived.get(record.robot, 0.0))
                self.moved = None
                self.obstacles.waits(record.robot, record.to)
            case records.Held():
                if record.why is HoldReason.STRATEGY:
                    self._stood(record.robot, long=True)
                self.moved = None
                self.obstacles.waits(record.robot, self.poses[record.robot].region)
            case records.Operator() if record.robot is not None and record.region is not None:
                self.poses[record.robot] = Pose.of(record.region, record.heading)
            case records.Goal() if self.pursues(record.robot):
                self.own[record.robot].meet(record)
                self.moved = None
            case _:
                pass

    def _changed(self, record: records.Record) -> None:
        """Record the robots' objectives and their progress."""
        match record:
            case records.Plan():
                self.plan.begin(record)
            case records.PlanEnd():
                self.plan.begin(None)
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
            case records.Inputs():
                self.inputs = *self.inputs[-1:], (record.tick, record.values)
                self.chosen = {name: record.values[name] for name in record.user or ()}
            case records.Resolved() if name_parts(record.obstacle)[0] != self.flat:
                for pursued in self.own.values():
                    pursued.recount(record.tick)
            case records.Service():
                if record.active:
                    self.own[record.robot].clock.restart(record.tick)
                if record.cause is not ChangeCause.BATTERY:
                    (self.out.discard if record.active else self.out.add)(record.robot)
            case records.Deadline() if record.of in self.own:
                judged = record.verdict not in (DeadlineVerdict.LOST, DeadlineVerdict.KEPT)
                self.own[record.of].clock.over |= judged
            case _:
                pass

    def _step(self, robot: str, pose: Pose, *, decided: bool) -> None:
        """Process a step, or a turn in which a robot stays. ``decided``: by its strategy."""
        before, self.poses[robot] = self.poses[robot], pose
        self.stayed = before.region == pose.region
        if not self.stayed:
            self.since[robot] = round(self.time)
        if pose != before:
            self.plan.step(robot, pose)
        memories = self.own[robot].memories
        if memories is not None and robot not in self.away and (decided or pose != before):
            tick = self.time if not self.live else 0
            then = [values for at, values in self.inputs if at < tick]
            now = [values for _, values in self.inputs]
            given = ({}, {}) if self.live else ((then or [{}])[-1], (now or [{}])[-1])
            memories.step(before, pose, given)
            self.arrived[robot] = self.time

    def _stood(self, robot: str, long: bool) -> None:
        """Record that a robot has stayed in its pose. ``long``: time has passed since it arrived
        there."""
        memories = self.own[robot].memories
        if memories is not None and robot not in self.away:
            memories.stood(self.poses[robot], long=long)

    def look(self) -> None:
        """Record the robots that do not pursue their own objective."""
        for name, pursued in self.own.items():
            pursued.clock.disturbed |= not self.pursues(name) or name in self.out

    def _waited(self) -> dict[str, int]:
        """The ticks for which robots have stood with the same target, except those at the region
        where they stay."""
        ages = {name: round(self.begins) + 1 - self.since.get(name, 1) for name in self.own}
        return {name: age for name, age in ages.items() if age > 0 and not self._stays(name)}

    def _stays(self, robot: str) -> bool:
        """Whether a robot has arrived at the region where it stays."""
        there = station(objective_of(self.in_force[robot]) or Ltl())
        return there is not None and self.poses[robot].region in there

    def _turn_over(self) -> None:
        """Count the turn that has ended."""
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
        due = {of: max(0, at - tick) for of, at in self.obstacles.due.items()} if timed else {}
        late = tuple(sorted(self.obstacles.late)) if timed else ()
        had = tuple(sorted(self.had)) if self.begins < self.time else ()
        closed = tuple(sorted(self.obstacles.closed))
        stays = tuple(sorted(self.obstacles.stays))
        return Begun(
            trace.digest or None,
            robots,
            due,
            late,
            closed,
            had,
            asked=self.obstacles.asked,
            stays=stays,
            plan=self.plan.left(self.poses),
            waited={} if self.live else self._waited(),
            charging=charging,
            ran=self.ran,
        )

    def _charges(self, robot: str, header: records.Header) -> bool:
        """Whether a robot charges where it stands: it stays there, but not for a request."""
        here, chargers = self.poses[robot].region, header.scenario.chargers or ()
        waits = any(here == waits.get(robot) for waits in self.obstacles.asked.values())
        charges = header.scenario.robots[robot].battery is not None and here in chargers
        return charges and not self.pursues(robot) and not waits and self._stays(robot)

    def _clock(self, robot: str, tick: int) -> RoundClock:
        """The clock of a round at a tick; one that is due by then is due at the start."""
        if robot in self.away:  # another round begins when it is back, even in tick 1
            return RoundClock(-1)
        own = self.own[robot]
        clock, since = own.clock, tick - own.clock.begun
        if own.within is not None and not clock.over:
            since = min(since, own.within)
        return RoundClock(since, clock.disturbed, clock.before, clock.over)

    def _is_uncounted(self, robot: str) -> bool:
        """Whether a robot's goal in its region is not counted yet: its turn was not over, it had
        another duty, or its next target is also there, which its strategy takes as met."""
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
        if record.cause is ChangeCause.INPUT:  # until the input changes again
            same = record.objective == own.objective
            (self.away.discard if same else self.away.add)(robot)
            own.rounds, own.begun, own.clock = 0, True, Round(record.tick)
            own.seen.clear()
        else:
            clock = Round(record.tick)
            self.own[robot] = Pursued(record.objective, record.within, clock=clock)

    def _turned(self, record: records.Synthesis) -> None:
        """Record that a strategy begins with another target than the next one."""
        if record.form is vocabulary.Form.OTHER_MEMORY and self.pursues(record.robot):
            self.own[record.robot].turn = next(iter((record.memory or {"": 0}).values()))


def ended_late(trace: Trace) -> bool:
    """Return whether a missed deadline ended the run."""
    return trace.outcome is not None and trace.outcome.outcome is Outcome.LATE
