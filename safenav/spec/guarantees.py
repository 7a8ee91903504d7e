"""The meaning of raw formulas (``ltl``) for a robot's steps and memory.

A step is a move from one pose to another; a stay is not a step. Formulas are about the pose and the
objective's memory before and after a step. Searches for paths use only poses: they may take a step,
or meet a goal, if the formulas allow that with some memory. So a path that they exclude is
impossible. ``allows_with`` checks each move with the robot's real memory before the robot makes it.
"""

from collections.abc import Mapping
from functools import cached_property, lru_cache
from itertools import product
from math import prod

from msgspec import Struct, field

from safenav.formula.parser import parse
from safenav.formula.syntax import Formula, Predicate, predicate, reads_next, variables
from safenav.scenario.objective import Ltl
from safenav.world.poses import Pose

MOST_VALUATIONS = 64
"""Maximum number of memory values; with more, formulas about memory exclude nothing in searches."""

Values = Mapping[str, int]


class GuaranteeRule(Struct, frozen=True, eq=False, dict=True):
    """One formula. Its truth on a step depends only on the variables that it names. Unknown
    ``inputs`` are on if in ``on`` (None: they make it true if possible)."""

    formula: Formula
    inputs: frozenset[str] = frozenset()
    on: frozenset[str] | None = None
    _known: dict[tuple[int | None, ...], bool] = field(default_factory=dict)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(sorted(variables(self.formula)))

    @cached_property
    def _predicate(self) -> Predicate:
        return predicate(self.formula)

    def holds(self, before: Values, after: Values) -> bool:
        for name in self.inputs.intersection(self.names):
            for given in (before, after):
                if name not in given:
                    values = (0, 1) if self.on is None else (int(name in self.on),)
                    choices = ({**given, name: value} for value in values)
                    if given is before:
                        return any(self.holds(choice, after) for choice in choices)
                    return any(self.holds(before, choice) for choice in choices)
        key = tuple(values.get(name) for values in (before, after) for name in self.names)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._predicate(before, after)
        return found


class Guarantees:
    """A robot's formulas, for evaluation on single steps. ``on``: the inputs that are always on
    (None: unknown)."""

    def __init__(self, objective: Ltl, on: frozenset[str] | None = None) -> None:
        self.goals = len(objective.liveness)
        inputs = frozenset(objective.inputs), on
        self._init = tuple(GuaranteeRule(parse(text)) for text in objective.init)
        self._liveness = tuple(GuaranteeRule(parse(text), *inputs) for text in objective.liveness)
        self._ranges = {
            name: range(2) if bounds is None else range(bounds[0], bounds[1] + 1)
            for name, bounds in objective.memory.items()
        }
        safety = [GuaranteeRule(parse(text), *inputs) for text in objective.safety]
        self._plain = [rule for rule in safety if not self._speaks_of_memory(rule)]
        self._rest = [rule for rule in safety if self._speaks_of_memory(rule)]

    @property
    def remember_something(self) -> bool:
        """Whether there is a memory, so that poses alone do not determine the allowed steps."""
        return bool(self._ranges)

    @cached_property
    def goals_of_steps(self) -> tuple[int, ...]:
        """The indices of the goals about steps, which a pose alone cannot meet."""
        goals = enumerate(self._liveness)
        return tuple(goal for goal, rule in goals if reads_next(rule.formula))

    def allows(self, before: Pose, after: Pose) -> bool:
        """Return whether the formulas allow a step for at least one memory."""
        one, other = values_of(before), values_of(after)
        if not all(rule.holds(one, other) for rule in self._plain):
            return False
        return not (self._rest and self.memories) or any(
            self.allows_with(before, old, after, new)
            for old, new in product(self.memories, repeat=2)
        )

    def meets(self, goal: int, before: Pose, after: Pose) -> bool:
        """Return whether a step or a stay meets a goal for at least one memory."""
        if not self._speaks_of_memory(self._liveness[goal]):
            return self.meets_with(goal, before, {}, after, {})
        return not self.memories or any(
            self.meets_with(goal, before, old, after, new)
            for old, new in product(self.memories, repeat=2)
        )

    def begins(self, memory: Values, pose: Pose) -> bool:
        """Return whether the robot may begin in this pose with this memory."""
        values = values_of(pose) | dict(memory)
        return all(rule.holds(values, values) for rule in self._init)

    def allows_with(self, before: Pose, old: Values, after: Pose, new: Values) -> bool:
        """Return whether a step or a stay is allowed with these memories before and after it."""
        one, other = values_of(before) | dict(old), values_of(after) | dict(new)
        return all(rule.holds(one, other) for rule in (*self._plain, *self._rest))

    def memory_after(self, before: Pose, old: Values, after: Pose) -> Values:
        """Return the memory after a step without a strategy or plan: unchanged unless the step
        requires another one."""
        found = ({**old, **memory} for memory in ({}, *self.memories))
        return next((new for new in found if self.allows_with(before, old, after, new)), old)

    def meets_with(self, goal: int, before: Pose, old: Values, after: Pose, new: Values) -> bool:
        """Return whether a step or a stay meets a goal with these memories before and after it."""
        one, other = values_of(before) | dict(old), values_of(after) | dict(new)
        return self._liveness[goal].holds(one, other)

    def _speaks_of_memory(self, rule: GuaranteeRule) -> bool:
        return any(name in self._ranges for name in rule.names)

    @cached_property
    def memories(self) -> tuple[dict[str, int], ...]:
        """All values of the memory, or none if there are too many."""
        count = prod(map(len, self._ranges.values()))
        every = product(*self._ranges.values()) if count <= MOST_VALUATIONS else ()
        return tuple(dict(zip(self._ranges, values, strict=True)) for values in every)


guarantees_of = lru_cache(maxsize=256)(Guarantees)
"""The guarantees of an objective, parsed once."""


def values_of(pose: Pose) -> dict[str, int]:
    """Return the variables of the specification that describe a robot's pose, with their values."""
    if pose.heading is None:
        return {"region": pose.region}
    return {"region": pose.region, "heading": int(pose.heading)}
