"""How far a robot is with its objective: which target is next, how many rounds are done.

The count is taken from where the robot really is, not from the automaton, so that a wrong
strategy cannot claim a goal. A round is complete when every target has been met since the
last one (in turn for ``patrol`` and ``visit``); each tick on its target is a round of ``hold``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.formula.syntax import Formula
from safenav.scenario.objective import (
    Cover,
    Hold,
    Ltl,
    Objective,
    Patrol,
    Target,
    Visit,
    targets_of,
)
from safenav.spec.objective import NO_MEMORY, Memory
from safenav.world.map import Region


@dataclass(frozen=True)
class Reached:
    """A goal that was met; ``announced`` is False for one more tick of holding."""

    goal: int
    announced: bool = True


class Progress:
    """The progress of one robot with one objective."""

    def __init__(self, objective: Objective, memory: Memory = NO_MEMORY) -> None:
        self.objective = objective
        self.rounds = 0
        self._targets = targets_of(objective)
        self._index = memory.index
        self._values: Mapping[str, int] = memory.values
        self._seen: set[int] = set()
        self._holding = False
        self._liveness: tuple[Formula, ...] = ()
        if isinstance(objective, Ltl):
            self._liveness = tuple(parse(line) for line in objective.liveness)

    @property
    def memory(self) -> Memory:
        """What the next specification of this objective must begin with."""
        return Memory(self._index, self._values)

    @property
    def seen(self) -> frozenset[int]:
        """The goals that were met in the round that is under way."""
        return frozenset(self._seen)

    def other_way_round(self) -> None:
        """Let a patrol go on with its other target."""
        self._index = 1 - self._index

    def awaited(self) -> Target:
        """The regions of which the robot must reach one next; none known for ``ltl``."""
        match self.objective:
            case Patrol() | Visit():
                return self._targets[self._index]
            case Cover(targets):
                left = [t for i, t in enumerate(targets) if i not in self._seen]
                return frozenset().union(*left)
            case Hold(target):
                return target
            case Ltl():
                return frozenset()

    def keep_memory(self, former: Progress) -> None:
        """Carry on with the memory of a former objective with the same ``ltl`` variables."""
        if isinstance(self.objective, Ltl):
            self._values = former.memory.values

    def restart_count(self) -> None:
        """Count rounds from zero: an obstacle was resolved (DESIGN section 5, rule 8)."""
        self.rounds = 0
        self._seen.clear()

    def begin(self, region: Region, values: Mapping[str, int]) -> list[Reached]:
        """Count what is met already where the robot stands when it gets the objective.

        ``values``: the variables of its specification there. A robot that stands on a target
        of a patrol begins with that one, as its specification does.
        """
        if isinstance(self.objective, Patrol):
            if region in self.objective.second:
                self._index = 1
            elif region in self.objective.first:
                self._index = 0
        if isinstance(self.objective, Ltl):
            self._remember(self.objective, values)
            return []
        return self.arrive(region, {}, {})

    def arrive(
        self, region: Region, before: Mapping[str, int], after: Mapping[str, int]
    ) -> list[Reached]:
        """Count a turn that ended in ``region``; ``before`` and ``after`` are the values of
        the specification's variables around it (used by ``ltl`` goals only)."""
        reached = self._reached(region, before, after)
        for goal in reached:
            self._seen.add(goal.goal)
        goals = max(1, len(self._targets) or len(self._liveness))
        if len(self._seen) == goals or (goals == 1 and reached):
            self.rounds += 1
            self._seen.clear()
        return [goal for goal in reached if goal.announced]

    def _reached(
        self, region: Region, before: Mapping[str, int], after: Mapping[str, int]
    ) -> list[Reached]:
        match self.objective:
            case Patrol() | Visit():
                if region not in self._targets[self._index]:
                    return []
                goal = self._index
                self._index = (goal + 1) % len(self._targets)
                return [Reached(goal)]
            case Cover(targets):
                found = [i for i, t in enumerate(targets) if region in t and i not in self._seen]
                return [Reached(i) for i in found]
            case Hold(target):
                there, was = region in target, self._holding
                self._holding = there
                return [Reached(0, announced=not was)] if there else []
            case Ltl():
                if not after:  # off the automaton: it backtracked, and nothing counts
                    return []
                self._remember(self.objective, after)
                if not self._liveness:
                    return [Reached(0, announced=False)]
                met = [i for i, f in enumerate(self._liveness) if evaluate(f, before, after)]
                return [Reached(i) for i in met if i not in self._seen]

    def _remember(self, objective: Ltl, values: Mapping[str, int]) -> None:
        self._values = {name: values[name] for name in objective.memory if name in values}
