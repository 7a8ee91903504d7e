"""What raw formulas (``ltl``) say about the ways of one robot: steps, goals, what it remembers.

A step is a move from one pose to another; a robot that stands still takes none. Formulas speak of
the pose and of the objective's memory before and after a step. The search for ways (``poses``) is
over poses alone: a step is open to it if the formulas allow it with some memory, and a goal may be
met in a pose if it is with some memory. So what the search finds impossible is; and whether a move
is allowed with the memory that the robot really has is asked before it is made (``remembered``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import product

from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.formula.syntax import Formula, variables
from safenav.runtime.poses import Mask, PoseGraph, bits
from safenav.scenario.model import Robot
from safenav.scenario.objective import Ltl
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility, Pose

MOST_VALUATIONS = 64
"""Of the memory; with more, formulas that speak of it exclude nothing in searches."""

Values = Mapping[str, int]


@dataclass(eq=False)
class Rule:
    """One formula. Its truth on a step depends on the variables that it names only."""

    formula: Formula
    _known: dict[tuple[int | None, ...], bool] = field(default_factory=dict)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(sorted(variables(self.formula)))

    def holds(self, before: Values, after: Values) -> bool:
        key = tuple(values.get(name) for values in (before, after) for name in self.names)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = evaluate(self.formula, before, after)
        return found


class Formulas:
    """The guarantees of one robot on one map."""

    def __init__(self, objective: Ltl, world: RegionMap, mobility: Mobility) -> None:
        self._safety = tuple(Rule(parse(text)) for text in objective.safety)
        self._liveness = tuple(Rule(parse(text)) for text in objective.liveness)
        self._graph = PoseGraph(world, mobility)
        self._ranges = {
            name: range(2) if bounds is None else range(bounds[0], bounds[1] + 1)
            for name, bounds in objective.memory.items()
        }

    @property
    def remember_something(self) -> bool:
        """Whether there is a memory, so that what a step means is not seen from its poses."""
        return bool(self._ranges)

    @cached_property
    def met_by_staying(self) -> bool:
        """Whether a robot that stays in a pose of ``goals`` meets the goal."""
        return not self._ranges and all(
            goal.holds(values_of(pose), values_of(pose))
            for goal, poses in zip(self._liveness, self.goals, strict=True)
            for pose in map(self._graph.pose, bits(poses))
        )

    @cached_property
    def graph(self) -> PoseGraph:
        """The robot's poses and the steps that the formulas allow with some memory."""
        return PoseGraph(self._graph.world, self._graph.mobility, frozenset(self._closed()))

    @cached_property
    def goals(self) -> tuple[Mask, ...]:
        """For each goal the poses in which it may be met: by staying there, or by a step into
        the pose where neither end would do."""
        return tuple(self._poses_of(goal) for goal in self._liveness)

    def remembered(self, memory: Values, before: Pose, after: Pose) -> Values | None:
        """What the robot may remember after a step, the least change first; None if its
        guarantees forbid the step with the memory that it has."""
        one, other = values_of(before), values_of(after)
        known = {name: value for name, value in memory.items() if name in self._ranges}
        free = {n: r for n, r in self._ranges.items() if n not in known}
        for fresh in _valuations(free):
            old = known | fresh
            for new in self._nearest(old):
                if all(rule.holds(one | old, other | new) for rule in self._safety):
                    return new
        return None

    def _nearest(self, memory: Mapping[str, int]) -> Iterator[dict[str, int]]:
        """All values of the memory; those that are there already first."""
        orders = {
            name: sorted(values, key=lambda value: value != memory[name])
            for name, values in self._ranges.items()
        }
        return _valuations(orders)

    def _closed(self) -> Iterator[tuple[int, int]]:
        graph = self._graph
        plain = [rule for rule in self._safety if not self._speaks_of_memory(rule)]
        rest = [rule for rule in self._safety if self._speaks_of_memory(rule)]
        pairs = list(product(self._memories, repeat=2)) if rest and self._memories else []
        for region in graph.world.free:
            for block in range(graph.blocks):
                pose = block * graph.size + region
                one = values_of(graph.pose(pose))
                for step in graph.steps(pose):
                    other = values_of(graph.pose(step))
                    allowed = all(rule.holds(one, other) for rule in plain) and (
                        not pairs
                        or any(
                            all(rule.holds(one | old, other | new) for rule in rest)
                            for old, new in pairs
                        )
                    )
                    if not allowed:
                        yield pose, step

    def _poses_of(self, goal: Rule) -> Mask:
        graph = self._graph
        memories = self._memories or ({},)
        if self._speaks_of_memory(goal) and not self._memories:
            return graph.everywhere
        pairs = list(product(memories, repeat=2)) if self._speaks_of_memory(goal) else [({}, {})]

        def meets(before: int, after: int) -> bool:
            one, other = values_of(graph.pose(before)), values_of(graph.pose(after))
            return any(goal.holds(one | old, other | new) for old, new in pairs)

        poses = [
            block * graph.size + region
            for region in graph.world.free
            for block in range(graph.blocks)
        ]
        staying = {pose for pose in poses if meets(pose, pose)}
        entered = {
            step
            for pose in poses
            if pose not in staying
            for step in self.graph.steps(pose)
            if step not in staying and meets(pose, step)
        }
        return sum(1 << pose for pose in staying | entered)

    def _speaks_of_memory(self, rule: Rule) -> bool:
        return any(name in self._ranges for name in rule.names)

    @cached_property
    def _memories(self) -> tuple[dict[str, int], ...]:
        """All values of the memory; none if there are too many to look at."""
        count = 1
        for values in self._ranges.values():
            count *= len(values)
        return tuple(_valuations(self._ranges)) if count <= MOST_VALUATIONS else ()


def formulas_of(robot: Robot, world: RegionMap) -> Formulas | None:
    """What a robot's own objective says in formulas; None if it is of another kind."""
    return _formulas(robot, world) if isinstance(robot.objective, Ltl) else None


@lru_cache(maxsize=256)
def _formulas(robot: Robot, world: RegionMap) -> Formulas:
    assert isinstance(robot.objective, Ltl)
    return Formulas(robot.objective, world, robot.model.mobility)


@lru_cache(maxsize=64)
def _plain_graph(world: RegionMap, mobility: Mobility) -> PoseGraph:
    return PoseGraph(world, mobility)


def graph_of(robot: Robot, world: RegionMap) -> PoseGraph:
    """The poses of a robot on a map and the steps that its guarantees allow, made once."""
    formulas = formulas_of(robot, world)
    return _plain_graph(world, robot.model.mobility) if formulas is None else formulas.graph


def values_of(pose: Pose) -> dict[str, int]:
    """The variables of a specification that say where a robot is."""
    if pose.heading is None:
        return {"region": pose.region}
    return {"region": pose.region, "heading": int(pose.heading)}


def _valuations(ranges: Mapping[str, Iterable[int]]) -> Iterator[dict[str, int]]:
    for values in product(*ranges.values()):
        yield dict(zip(ranges, values, strict=True))
