"""State graphs of robots whose formulas have memory or goals about steps: a state is a pose with
the memory there and the goals that the step into it has met.

A state is the number of a pose plus the number of a memory times the number of poses, so that
regions are found in it as in a pose. A step leads to each memory that the formulas allow after it;
standing still is not a step. The step into the first state of a path is unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from itertools import combinations, product

from msgspec.structs import replace

from safenav.cached_method import cached_method
from safenav.runtime.resolution.problem import Problem
from safenav.runtime.traffic.budgets import REMEMBERED_STATES
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import Mask, PoseGraph, bits, plain_graph


class StateGraph(PoseGraph):
    """States of formulas with memory on one map, and the steps between them. ``stays``: include
    changes of memory of a robot that stays, which its strategy may make; proofs need them."""

    def __init__(
        self, objective: Ltl, world: RegionMap, mobility: Mobility, *, stays: bool = False
    ) -> None:
        super().__init__(world, mobility)
        self._also_stays = stays
        self._guarantees = guarantees_of(objective)
        goals = self._guarantees.goals_of_steps
        met = [frozenset(few) for n in range(len(goals) + 1) for few in combinations(goals, n)]
        self._memories = [*product(self._guarantees.memories, met)]
        self._span = self.size * self.blocks
        self.blocks *= len(self._memories)

    @property
    def one_way(self) -> bool:
        """Return whether some steps are irreversible, since a change of memory may be."""
        return self._guarantees.remember_something or self._poses.one_way

    def state(self, pose: int, memory: Mapping[str, int]) -> int | None:
        """Return the state of a robot in a pose; None if its memory is not one of the graph's."""
        begun = dict(memory), frozenset[int]()
        found = (k for k, known in enumerate(self._memories) if known == begun)
        return next((pose + k * self._span for k in found), None)

    def pose(self, number: int) -> Pose:
        return super().pose(self.plain(number))

    def plain(self, state: int) -> int:
        """Return the number of a state's pose."""
        return state % self._span

    def after(self, state: int, pose: int) -> list[int]:
        """Return the states to which a step into a pose may lead."""
        return [step for step in self.steps(state) if self.plain(step) == pose]

    def lifted(self, poses: Mask) -> Mask:
        """Return all states in a set of poses."""
        return sum(poses << k * self._span for k in range(len(self._memories)))

    @cached_method
    def steps(self, pose: int) -> tuple[int, ...]:
        k, here = divmod(pose, self._span)
        before, (old, _) = self._poses.pose(here), self._memories[k]
        stay = (here,) if self._also_stays else ()
        return tuple(
            to + later * self._span
            for to in (*self._poses.steps(here), *stay)
            for later, (new, met) in enumerate(self._memories)
            if to + later * self._span != pose
            and self._guarantees.allows_with(before, old, self._poses.pose(to), new)
            and met == self._met_on(before, old, self._poses.pose(to), new)
        )

    def forward(self, poses: Mask) -> Mask:
        found = 0
        for state in bits(poses):
            for step in self.steps(state):
                found |= 1 << step
        return found

    def backward(self, poses: Mask) -> Mask:
        found = 0
        for state in bits(poses):
            found |= self._before.get(state, 0)
        return found

    @cached_property
    def goals(self) -> tuple[Mask, ...]:
        """Return for each goal the states in which it is met: by staying there, or by the step into
        it if staying at neither end meets the goal."""
        return tuple(
            sum(
                1 << state
                for state in bits(self.everywhere)
                if self._stays(goal, *self._at(state)) or goal in self._of(state)[1]
            )
            for goal in range(self._guarantees.goals)
        )

    def _of(self, state: int) -> tuple[Mapping[str, int], frozenset[int]]:
        """Return the memory in a state, and the goals that the step into it has met."""
        return self._memories[state // self._span]

    def _at(self, state: int) -> tuple[Pose, Mapping[str, int]]:
        return self.pose(state), self._of(state)[0]

    def _stays(self, goal: int, pose: Pose, memory: Mapping[str, int]) -> bool:
        """Return whether a robot that stays meets a goal."""
        return self._guarantees.meets_with(goal, pose, memory, pose, memory)

    def _met_on(
        self, before: Pose, old: Mapping[str, int], after: Pose, new: Mapping[str, int]
    ) -> frozenset[int]:
        """Return the goals that a step meets but staying at either end does not."""
        return frozenset(
            goal
            for goal in self._guarantees.goals_of_steps
            if self._guarantees.meets_with(goal, before, old, after, new)
            and not self._stays(goal, before, old)
            and not self._stays(goal, after, new)
        )

    @cached_property
    def _poses(self) -> PoseGraph:
        return plain_graph(self.world, self.mobility)

    @cached_property
    def _before(self) -> dict[int, Mask]:
        found: dict[int, Mask] = {}
        for state in bits(self.everywhere):
            for step in self.steps(state):
                found[step] = found.get(step, 0) | 1 << state
        return found


def plain_poses(problem: Problem, states: tuple[int, ...]) -> tuple[int, ...]:
    """Return the poses of the robots of a problem without their memory."""
    return tuple(
        member.graph.plain(state) if isinstance(member.graph, StateGraph) else state
        for member, state in zip(problem.members, states, strict=True)
    )


def with_memory(problem: Problem, graphs: Mapping[int, StateGraph]) -> Problem:
    """Return the problem with the memory of some robots."""
    members = list(problem.members)
    for index, graph in graphs.items():
        lifted = graph.lifted(members[index].floor)
        members[index] = replace(members[index], graph=graph, floor=lifted, targets=graph.goals)
    return replace(problem, members=tuple(members))


def remembering(problem: Problem) -> bool:
    """Return whether the problem includes the memory of a robot."""
    return any(isinstance(member.graph, StateGraph) for member in problem.members)


@lru_cache(maxsize=64)
def state_graph(
    objective: Ltl, world: RegionMap, mobility: Mobility, *, stays: bool = False
) -> StateGraph | None:
    """Return the cached state graph of an objective on a map; None if it has no memory, or too
    much."""
    guarantees = guarantees_of(objective)
    poses = len(world.free) * (4 if mobility is Mobility.HEADING else 1)
    count = len(guarantees.memories) << len(guarantees.goals_of_steps)
    plain = not (guarantees.remember_something or guarantees.goals_of_steps)
    if plain or not 0 < count * poses <= REMEMBERED_STATES:
        return None
    return StateGraph(objective, world, mobility, stays=stays)
