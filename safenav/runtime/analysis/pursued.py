"""Progress of robots with their own objectives and on a joint plan, by the lines of a trace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct, field

from safenav.begun import PlanLeft
from safenav.runtime.deadline_monitor.ledger import Round
from safenav.scenario.guarantees import MOST_VALUATIONS, Guarantees, Values, guarantees_of
from safenav.scenario.objective import Ltl, Objective
from safenav.trace import records, setting
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.told_objective import objective_of
from safenav.world.map import Region
from safenav.world.moves import Pose


class Pursued(Struct):
    """A robot's own objective, with rounds of at most ``within`` ticks, and its progress with it.
    ``begun``: goals count; ``memories``: those of its formulas, if it has any."""

    objective: TracedObjective
    within: int | None = None
    begun: bool = False
    rounds: int = 0
    seen: set[int] = field(default_factory=set)
    turn: int = 0
    clock: Round = field(default_factory=Round)
    memories: Memories | None = None

    @classmethod
    def at_start(cls, name: str, header: setting.ScenarioHeader) -> Pursued:
        """Return the progress of a robot at the start of a trace."""
        within = {} if header.promises is None else header.promises.within
        own = cls(header.robots[name].objective, within.get(name))
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

    @property
    def pursuit(self) -> Objective:
        """The objective itself; one without targets if its kind is unknown."""
        return objective_of(self.objective) or Ltl()

    def meet(self, goal: records.Goal) -> None:
        """Count a goal."""
        known, counted = self.pursuit, goal.round > self.rounds
        self.begun, self.rounds = True, goal.round
        self.seen.add(goal.goal)
        if counted or (known.settles and self.rounds):  # it stays where it has met all targets
            self.seen.clear()
        if counted:
            self.clock.restart(goal.tick)
        if known.in_turn:
            last = len(known.targets) - 1
            ahead = min(goal.goal + 1, last) if known.settles else (goal.goal + 1) % (last + 1)
            self.turn = ahead

    def stay(self, region: int) -> None:
        """Count a turn that ends in a region: ticks in which a settled robot meets its target have
        no line."""
        if self.begun and self.pursuit.stays(self.turn, region):
            self.rounds += 1
        self.begun = True

    def recount(self, tick: int) -> None:
        """Restart the round count at a resolution."""
        self.rounds = 0
        self.seen.clear()
        self.clock.restart(tick)


class Memories(Struct):
    """The memories that a robot's formulas may have, the likeliest first; empty if they have more
    than MOST_VALUATIONS values. Several may fit, since a trace has poses, not nodes. Each belongs
    to a behaviour that keeps the formulas, so the run can continue with any of them. ``begun``: a
    strategy has chosen among the initial ones. ``ahead``: the region to which a robot is in
    transit, and its memory there, if it got a strategy meanwhile."""

    guarantees: Guarantees
    possible: Sequence[Mapping[str, int]]
    begun: bool = False
    ahead: tuple[Region, Mapping[str, int]] | None = None

    @classmethod
    def at_start(cls, guarantees: Guarantees, pose: Pose) -> Memories:
        """Return the memories with which the objective may begin in a pose."""
        fit = (memory for memory in guarantees.memories if guarantees.begins(memory, pose))
        return cls(guarantees, [*fit])

    @property
    def likeliest(self) -> Mapping[str, int]:
        """The memory with which to continue; empty before the first step."""
        return next(iter(self.possible), {}) if self.begun else {}

    def choose(self, memory: Mapping[str, int], region: Region, here: Region) -> None:
        """Begin with a strategy that has this memory in a region: ``here``, or where the robot's
        step leads."""
        self.begun, self.ahead = True, None if region == here else (region, memory)
        if self.ahead is None:
            self.possible = [memory]

    def step(self, before: Pose, after: Pose, inputs: tuple[Values, Values]) -> None:
        """Process a step, or a turn in which a strategy let the robot stay. A step that the
        formulas forbid was not a strategy's, and changes nothing."""
        ahead, self.ahead = self.ahead, None
        if ahead is not None and ahead[0] == after.region:
            self.possible = [ahead[1]]
            return
        found = self._after(self.possible, before, after, inputs)
        self.possible, self.begun = found or self.possible, True

    def stood(self, pose: Pose, *, long: bool) -> None:
        """Record that a robot may have stayed in turns without lines. ``long``: time has passed
        since it arrived, so it probably has."""
        self.begun = True
        stayed = self._after(self.possible, pose, pose, ({}, {}))
        both = (*stayed, *self.possible) if long else (*self.possible, *stayed)
        self.possible = _different(iter(both))

    def _after(
        self,
        memories: Iterable[Mapping[str, int]],
        before: Pose,
        after: Pose,
        inputs: tuple[Values, Values],
    ) -> list[Mapping[str, int]]:
        return _different(
            new
            for memory in memories
            for new in self.guarantees.after(memory, before, after, inputs)
        )


def _different(memories: Iterator[Mapping[str, int]]) -> list[Mapping[str, int]]:
    """Return the first different memories, at most MOST_VALUATIONS."""
    found: dict[tuple[tuple[str, int], ...], Mapping[str, int]] = {}
    for memory in memories:
        found.setdefault(tuple(sorted(memory.items())), memory)
        if len(found) == MOST_VALUATIONS:
            break
    return [*found.values()]


class FollowedPlan(Struct):
    """A joint ``plan`` (None: there is none), with the number of steps that each robot has
    ``taken``; ``to_follow``: it is the plan of the earlier run, which no robot follows yet."""

    plan: PlanLeft | None = None
    taken: dict[str, int] = field(default_factory=dict)
    to_follow: bool = False

    def begin(self, plan: records.Plan | PlanLeft | None, *, to_follow: bool = False) -> None:
        """Follow a joint plan, or none, from now on."""
        self.plan = None if plan is None else PlanLeft(plan.robots, plan.orders, plan.reason)
        self.taken = {} if plan is None else dict.fromkeys(plan.robots, 0)
        self.to_follow = to_follow

    def sets_out(self) -> None:
        """Forget the plan of the earlier run if a robot departs before any robot follows that
        plan."""
        if self.to_follow:
            self.begin(None)

    def step(self, robot: str, pose: Pose) -> None:
        """Count a step of a robot if it is the next one of the plan."""
        if self.plan is not None and robot in self.plan.robots:
            ahead = self.plan.robots[robot][self.taken[robot] + 1 :]
            self.taken[robot] += bool(ahead) and Pose.of(*ahead[0]) == pose

    def left(self, poses: Mapping[str, Pose]) -> PlanLeft | None:
        """The rest of the plan; None if a robot has left it, or all have arrived."""
        if self.plan is None or self.plan.robots.keys() != poses.keys():
            return None
        left = {name: path[self.taken[name] :] for name, path in self.plan.robots.items()}
        if all(len(path) == 1 for path in left.values()):
            return None
        for name, path in left.items():
            here = poses[name]
            if len(path) == 1:  # the robot may have left the plan
                left[name] = (here.place,)
            elif Pose.of(*path[0]) != here:
                return None
        orders = (
            (first, i - self.taken[first], then, j - self.taken[then])
            for first, i, then, j in self.plan.orders
        )
        to_come = tuple(order for order in orders if order[1] > 0 and order[3] > 0)
        return PlanLeft(left, to_come, self.plan.reason)
