"""Progress of a robot with its objective: its next target, and the completed rounds.

Goals are counted by the robot's actual pose, not by its strategy, so that a wrong strategy cannot
claim one. The objective's own automaton determines what counts and what completes a round
(``scenario.objective``); raw formulas are evaluated on each step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

from safenav.begun import Done
from safenav.formula.evaluator import Predicate, predicate
from safenav.formula.parser import parse
from safenav.scenario.objective import Ltl, Objective, Target
from safenav.spec.objective import NO_MEMORY, Memory
from safenav.world.map import Region


@lru_cache(maxsize=1 << 13)
def holds(formula: str) -> Predicate:
    """Return a formula as a predicate of a state and its successor."""
    return predicate(parse(formula))


class Progress:
    """The progress of one robot with one objective."""

    def __init__(self, objective: Objective, memory: Memory = NO_MEMORY) -> None:
        self.objective = objective
        self.rounds = 0
        self._state = memory.index  # memory of the pursuit
        self._values: Mapping[str, int] = memory.values
        self._seen: set[int] = set()
        self._holding = False
        self._completed = False  # whether the last goals completed a round

    @property
    def memory(self) -> Memory:
        """The memory that the next specification of this objective must begin with."""
        return Memory(self._state if self.objective.in_turn else 0, self._values)

    @property
    def seen(self) -> frozenset[int]:
        """The goals that were met in the current round."""
        return frozenset(self._seen)

    @property
    def mark(self) -> tuple[int, ...]:
        """A key that changes with every turn that makes progress."""
        holds = self._holding, self._completed
        return self.rounds, self._state, len(self._seen), *holds

    @classmethod
    def continued(cls, objective: Objective, done: Done) -> Progress:
        """Return the progress with which a continued run begins."""
        found = cls(objective, Memory(done.turn, done.memory))
        found.rounds = done.rounds
        found._seen.update(done.seen)
        if not (isinstance(objective, Ltl) or objective.in_turn):
            found._state = sum(1 << goal for goal in done.seen)
        return found

    def leave(self) -> None:
        """Note that the robot no longer holds its target: it meets the target when it returns."""
        self._holding = False

    def begin_with(self, index: int) -> None:
        """Make target ``index`` the next one."""
        assert self.objective.strict
        self._state = index

    def stands(self, region: Region) -> bool:
        """Whether a robot that stands in ``region`` is where its objective ends; True if it has no
        end."""
        return not self.objective.settles or self.objective.stays(self._state, region)

    def awaited(self) -> Target:
        """The regions of which the robot must reach one next; empty for ``ltl``."""
        own = self.objective
        return frozenset() if isinstance(own, Ltl) else own.awaited(self._state)

    def means(self, memory: int, region: Region) -> bool:
        """Whether ``memory`` of a specification in ``region`` represents this progress: there
        memory changes one step after a goal, here with the goal."""
        own = self.objective
        return isinstance(own, Ltl) or own.turned(memory, region) == self._state

    def keep_memory(self, former: Progress) -> None:
        """Keep the formula memory of a former objective."""
        self._values = former.memory.values

    def remember(self, values: Mapping[str, int]) -> None:
        """Update the formula memory."""
        if isinstance(self.objective, Ltl):
            self._values = {n: values[n] for n in self.objective.memory if n in values}

    def restart_count(self) -> None:
        """Count rounds from zero, since an obstacle was resolved (docs/coordination.md)."""
        self.rounds = 0
        self._seen.clear()
        if not self.objective.in_turn:
            self._state = 0

    def begin(self, region: Region, values: Mapping[str, int]) -> list[int]:
        """Count the goals that are already met where the robot stands when it gets the objective;
        return the goals to record (for holding, those of the first tick).

        ``values``: the variables of its specification there. A robot that stands on a target
        of a strict objective begins with that one, as its specification does.
        """
        if isinstance(self.objective, Ltl):
            self.remember(values)
            return []
        self._state = self.objective.begin(region, self._state)
        return self.arrive(region, {}, {})

    def arrive(
        self, region: Region, before: Mapping[str, int], after: Mapping[str, int]
    ) -> list[int]:
        """Count a turn that ended in ``region``, and return goals as ``begin`` does; ``before``
        and ``after`` are the values of the specification's variables around it (used by ``ltl``
        goals only)."""
        objective, held, state = self.objective, self._holding, self._state
        if isinstance(objective, Ltl):
            met = self._met_by_formulas(objective, before, after)
        else:
            met = objective.met(state, region)
            self._state = objective.turned(state, region)
        self._holding = objective.stays(state, region)
        fresh = [goal for goal in met if goal not in self._seen]
        self._seen.update(fresh)
        self._completed = bool(fresh) and objective.ends_round(self._seen)
        if self._completed:
            self.rounds += 1
            self._seen.clear()
        if held or (isinstance(objective, Ltl) and not objective.liveness):
            return []
        # In turn a target may count again in a round that restarted with the other one.
        return list(met if self.objective.in_turn else fresh)

    def met_by_staying(
        self, region: Region, before: Mapping[str, int], after: Mapping[str, int]
    ) -> bool:
        """Whether a robot that stays in ``region`` without having to meets every goal in each turn;
        ``before`` and ``after`` as in ``arrive``."""
        if isinstance(self.objective, Ltl):
            goals = map(holds, self.objective.liveness)
            return bool(after) and all(goal(before, after) for goal in goals)
        free = not self.objective.settles
        return free and all(region in target for target in self.objective.targets)

    def counted(self, goals: Sequence[int]) -> list[tuple[int, int]]:
        """Return the goals just met simultaneously, each with the rounds completed after it: the
        last of them completes one, if any does."""
        before = self.rounds - self._completed
        last = len(goals) - 1
        return [(goal, self.rounds if k == last else before) for k, goal in enumerate(goals)]

    def _met_by_formulas(
        self, objective: Ltl, before: Mapping[str, int], after: Mapping[str, int]
    ) -> tuple[int, ...]:
        """The formula goals that a step meets. Without goals every step counts."""
        if not after:  # off the automaton: it backtracked, and nothing counts
            return ()
        self.remember(after)
        goals = enumerate(map(holds, objective.liveness))
        return tuple(i for i, goal in goals if goal(before, after)) if objective.liveness else (0,)
