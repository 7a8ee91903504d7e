"""A robot's progress with its own objective, as the lines of a trace tell it."""

from __future__ import annotations

from msgspec import Struct, field

from safenav.runtime.analysis.memories import Memories
from safenav.runtime.deadline_monitor.ledger import Round
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl, Objective
from safenav.trace import records, setting
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.told_objective import objective_of
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
