"""Milestones of robots whose goals do not follow from poses alone.

Formulas may have memory: "be at the dock again after having seen the shelf". Joint plans over poses
alone would take the robot to the dock. Its strategy supplies the milestone: the end of the shortest
of its paths on which a goal is met, up to the first step that changes the memory.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from functools import cached_property
from itertools import pairwise

from safenav.cached_method import cached_method
from safenav.components import path_to
from safenav.runtime.progress import holds
from safenav.runtime.traffic.budgets import AIM_NODES
from safenav.scenario.objective import Ltl
from safenav.synthesis.strategy import Strategy
from safenav.world.map import Heading
from safenav.world.moves import Pose

Row = tuple[int, ...]
"""The part of a node that formulas refer to: region, heading if there is one, memory, inputs."""


class Milestones:
    """Milestones of a robot with formulas, by one of its strategies. Results are cached.
    ``inputs``: names of the environment inputs that formulas may name."""

    def __init__(self, strategy: Strategy, objective: Ltl, inputs: Collection[str]) -> None:
        self.strategy = strategy
        self._objective = objective
        self._goals = tuple(map(holds, objective.liveness))
        known = strategy.values(0)
        pose = [name for name in ("region", "heading") if name in known]
        memory = [name for name in objective.memory if name in known]
        self._memory = slice(len(pose), len(pose) + len(memory))
        self._names = (*pose, *memory, *(name for name in inputs if name in known))

    @cached_method
    def aim(self, node: int, met: frozenset[int]) -> Pose | None:
        """Return the pose that the robot must reach first; None if the robot stands there or the
        pose is unknown. ``met``: the goals of its formulas that it has met in this round."""
        way = self._way(node, met)
        return None if way is None else self._milestone(way)

    def _way(self, node: int, met: frozenset[int]) -> list[int] | None:
        """Return the shortest path of the strategy from a node that meets one of the other goals;
        None if none is found."""
        rows, transitions = self._rows, self.strategy.transitions
        before = {node: node}
        queue = deque([node])
        while queue and len(before) < AIM_NODES:
            here = queue.popleft()
            for after in transitions[here]:
                if self._goals_of(rows[here], rows[after]) - met:
                    return [*path_to(here, before), after]
                if after not in before:
                    before[after] = here
                    queue.append(after)
        return None

    @cached_method
    def _goals_of(self, before: Row, after: Row) -> frozenset[int]:
        """Return the goals that a step between two nodes meets."""
        one = dict(zip(self._names, before, strict=True))
        other = dict(zip(self._names, after, strict=True))
        return frozenset(i for i, goal in enumerate(self._goals) if goal(one, other))

    def _milestone(self, way: list[int]) -> Pose | None:
        """Return the first pose of a path, other than the present one, where the memory changes or
        the goal is met."""
        rows = [self._rows[node] for node in way]
        here = self._pose(rows[0])
        for step, (before, after) in enumerate(pairwise(rows)):
            if step == len(rows) - 2 or before[self._memory] != after[self._memory]:
                for pose in (self._pose(before), self._pose(after)):
                    if pose != here:
                        return pose
        return None

    def _pose(self, row: Row) -> Pose:
        heading = Heading(row[1]) if "heading" in self._names else None
        return Pose(row[0], heading)

    @cached_property
    def _rows(self) -> list[Row]:
        fields = {field.variable.name: field for field in self.strategy.fields}
        wanted = [fields[name] for name in self._names]
        return [tuple(field.decode(state) for field in wanted) for state in self.strategy.states]
