"""A robot's progress with its own objective, as the lines of a trace tell it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct, field

from safenav.runtime.deadline_monitor.ledger import Round
from safenav.scenario.guarantees import MOST_VALUATIONS, Guarantees, Values, guarantees_of
from safenav.scenario.objective import Ltl, Objective
from safenav.trace import records, setting
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.told_objective import objective_of
from safenav.world.map import Region
from safenav.world.moves import Pose


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

    @classmethod
    def at_start(cls, name: str, header: setting.ScenarioHeader) -> Pursued:
        """The progress of a robot with which a trace begins."""
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


class Memories(Struct):
    """The memories that a robot's formulas may have, the likeliest first; none if too many fit: a
    trace has poses, not nodes. Each that fits is one of a behaviour that keeps the formulas, so any
    of them continues it. ``begun``: by a strategy, which has chosen among those at the start.
    ``ahead``: the region to which it is on its way, and what it remembers there, if it has got a
    strategy meanwhile."""

    guarantees: Guarantees
    possible: Sequence[Mapping[str, int]]
    begun: bool = False
    ahead: tuple[Region, Mapping[str, int]] | None = None

    @classmethod
    def at_start(cls, guarantees: Guarantees, pose: Pose) -> Memories:
        """Those with which the objective may begin in a pose."""
        fit = (memory for memory in guarantees.memories if guarantees.begins(memory, pose))
        return cls(guarantees, [*fit])

    @property
    def likeliest(self) -> Mapping[str, int]:
        """The one to continue with; none before the first step."""
        return next(iter(self.possible), {}) if self.begun else {}

    def choose(self, memory: Mapping[str, int], region: Region, here: Region) -> None:
        """Begin with a strategy that remembers that in a region: here, or where the robot is on its
        way."""
        self.begun, self.ahead = True, None if region == here else (region, memory)
        if self.ahead is None:
            self.possible = [memory]

    def step(self, before: Pose, after: Pose, inputs: tuple[Values, Values]) -> None:
        """Follow a step, or a turn in which a strategy has let the robot stay. A step that the
        formulas forbid was made by no strategy: it changes nothing."""
        ahead, self.ahead = self.ahead, None
        if ahead is not None and ahead[0] == after.region:
            self.possible = [ahead[1]]
            return
        found = self._after(self.possible, before, after, inputs)
        self.possible, self.begun = found or self.possible, True

    def stood(self, pose: Pose, *, long: bool) -> None:
        """Note that a robot may have stayed in turns that have no lines. ``long``: time has passed
        since it arrived there, so that it probably has."""
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
    """The first so many different memories."""
    found: dict[tuple[tuple[str, int], ...], Mapping[str, int]] = {}
    for memory in memories:
        found.setdefault(tuple(sorted(memory.items())), memory)
        if len(found) == MOST_VALUATIONS:
            break
    return [*found.values()]
