"""SOLVE: an order in which robots resolve obstacles, so that every robot can continue in the end.

Robots are sets of poses here, those that each may choose to be in, and do not collide. A step
fulfils one need of one obstacle: a group of capable robots goes where it can be fulfilled.
Resolving only opens paths, and a step after which each robot of the group can come back to wherever
it may have been loses nothing. So such a step is taken immediately, and the search branches only
over irreversible choices. Without collisions the search fails iff no order of moves and resolutions
keeps every robot able to continue (docs/coordination.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations

from msgspec import Struct, field

from safenav.runtime.resolution.problem import Problem, SpentError, Stages
from safenav.world.poses import FAR, Mask

BUDGET = 20_000
"""Nodes of one search; the largest trees seen had three."""

Sets = tuple[Mask, ...]
"""The poses that each robot may choose to be in."""


class Step(Struct, frozen=True):
    """One need of one obstacle, met by ``group``; ``at``: in which poses each may meet it."""

    gate: int
    need: int
    group: tuple[int, ...]
    at: tuple[Mask, ...]


Plan = tuple[Step, ...]


class RankedStep(Struct, frozen=True):
    """A step that could come next, with its merits."""

    step: Step
    lossless: bool
    rank: tuple[int, ...]


class Solver(Struct):
    """Solves one problem; results for equal states come from memory.

    ``stopping`` is called now and then and raises to end a search from outside.
    """

    problem: Problem
    stopping: Callable[[], None] = lambda: None
    budget: int = BUDGET
    _memo: dict[tuple[Sets, Stages, frozenset[int]], Plan | None] = field(default_factory=dict)
    _nodes: int = 0

    def sets(self, poses: tuple[int, ...], stages: Stages) -> Sets:
        """Return each robot's strongly connected pose set; the search treats its members alike."""
        return tuple(self.set_of(i, 1 << pose, stages) for i, pose in enumerate(poses))

    def set_of(self, robot: int, poses: Mask, stages: Stages) -> Mask:
        """``poses`` of a robot, or all that are as good as a single one."""
        if poses & (poses - 1):
            return poses
        return self.problem.members[robot].graph.around(poses, self.problem.allowed(robot, stages))

    def feasible(self, sets: Sets, stages: Stages, wanted: frozenset[int] = frozenset()) -> bool:
        """Whether ``wanted`` can be resolved and all robots continue forever. Raises SpentError."""
        self._nodes = 0
        return self._solve(sets, None, stages, wanted, {}) is not None

    def plan(
        self,
        poses: tuple[int, ...],
        stages: Stages,
        wanted: frozenset[int],
        present: Mapping[int, tuple[int, ...]],
    ) -> Plan | None:
        """Return the steps, without those that nothing needs: by the robots that are there first,
        in ticks, but by the ``present`` helpers of an obstacle where they suffice. Raises
        SpentError."""
        self._nodes = 0
        sets = self.sets(poses, stages)
        origins = tuple(1 << pose for pose in poses)
        found = self._solve(sets, origins, stages, wanted, present)
        return None if found is None else self._pruned(found, sets, stages, wanted)

    def goes_on(self, robot: int, poses: Mask, stages: Stages) -> bool:
        """Whether a robot can continue forever from some of ``poses``, obstacles being walls."""
        member = self.problem.members[robot]
        allowed = self.problem.allowed(robot, stages)
        reach = member.graph.closure(poses, allowed)
        return bool(reach & member.live(allowed))

    def reach(self, robot: int, poses: Mask, stages: Stages) -> Mask:
        """Return the poses that a robot can reach while the open obstacles are walls."""
        allowed = self.problem.allowed(robot, stages)
        return self.problem.members[robot].graph.closure(poses, allowed)

    def after(self, step: Step, sets: Sets, stages: Stages) -> tuple[Sets, Stages]:
        """Return sets and stages after a step."""
        changed = list(sets)
        for robot, at in zip(step.group, step.at, strict=True):
            changed[robot] = at
        return tuple(changed), self.problem.advanced(step.gate, stages, step.group)

    def options(
        self,
        sets: Sets,
        origins: Sets | None,
        stages: Stages,
        present: Mapping[int, tuple[int, ...]],
        *,
        every: bool = False,
    ) -> list[RankedStep]:
        """Return the steps that could come next, the best first. One step per obstacle is enough
        among those that lose nothing, unless ``every`` one is wanted."""
        found = [
            option
            for gate in self.problem.open(stages)
            for option in self._options_for(gate, sets, origins, stages, present, every)
        ]
        return sorted(found, key=lambda option: (not option.lossless, option.rank))

    def _solve(
        self,
        sets: Sets,
        origins: Sets | None,
        stages: Stages,
        wanted: frozenset[int],
        present: Mapping[int, tuple[int, ...]],
    ) -> Plan | None:
        key = (sets, stages, wanted)
        if origins is None and key in self._memo:
            return self._memo[key]
        self._nodes += 1
        if self._nodes > self.budget:
            raise SpentError
        self.stopping()
        found: Plan | None = () if self._done(sets, stages, wanted) else None
        for option in self.options(sets, origins, stages, present) if found is None else ():
            step = option.step
            after, then = self.after(step, sets, stages)
            there = None if origins is None else self.after(step, origins, stages)[0]
            rest = self._solve(after, there, then, wanted, present)
            found = None if rest is None else (step, *rest)
            if found is not None or option.lossless:
                break  # nothing was lost by it, so nothing else would do either
        if origins is None or found is None:
            self._memo[key] = found
        return found

    def _done(self, sets: Sets, stages: Stages, wanted: frozenset[int]) -> bool:
        """Whether ``wanted`` is resolved and all robots can continue forever."""
        resolved = all(self.problem.resolved(gate, stages) for gate in wanted)
        return resolved and all(self.goes_on(i, poses, stages) for i, poses in enumerate(sets))

    def _options_for(
        self,
        gate: int,
        sets: Sets,
        origins: Sets | None,
        stages: Stages,
        present: Mapping[int, tuple[int, ...]],
        every: bool,
    ) -> list[RankedStep]:
        problem = self.problem
        need = problem.next_need(gate, stages)
        then = problem.advanced(gate, stages)
        places: dict[int, Mask] = {}
        ticks: dict[int, int] = {}
        for robot in problem.able(gate, stages):
            member = problem.members[robot]
            allowed = problem.allowed(robot, stages)
            there = member.graph.closure(sets[robot], allowed) & member.graph.poses_on(need.regions)
            if there:
                places[robot] = there
                if origins is not None:
                    steps = member.graph.steps_between(origins[robot], there, allowed) or 0
                    for further in problem.gates[gate].chain(stages[gate].need)[1:]:
                        goal = member.graph.poses_on(further.regions)
                        more = member.graph.steps_between(there, goal, allowed)
                        steps, there = steps + (FAR if more is None else more), goal
                    ticks[robot] = steps * member.ticks
        helping = present.get(gate, ())
        elsewhere = set[int]()
        if problem.newest_first:  # a robot that serves no other request is preferred
            elsewhere.update(*(present.get(o, ()) for o in problem.open(stages) if o != gate))
        able = sorted(places, key=lambda i: (i in elsewhere, i not in helping, ticks.get(i, 0), i))
        back = {i: not sets[i] & ~self.reach(i, places[i], then) for i in able}
        able.sort(key=lambda i: not back[i])
        commits = problem.commits(gate, stages)
        found = []
        for group in combinations(able, max(1, problem.missing(gate, stages))):
            if need.together and not fits(problem, group, places):
                continue
            lossless = all(back[i] for i in group) and not commits
            slowest = max(ticks.get(i, 0) for i in group)
            strangers = sum(i not in helping for i in group)
            rank: tuple[int, ...] = (strangers, slowest, gate)
            if problem.newest_first:
                rank = (gate, sum(i in elsewhere for i in group), strangers, slowest)
            step = Step(gate, stages[gate].need, group, tuple(places[i] for i in group))
            found.append(RankedStep(step, lossless, (*rank, *group)))
            if lossless and not every:
                break  # the first group is the best of those that lose nothing
        return found

    def _pruned(self, plan: Plan, sets: Sets, stages: Stages, wanted: frozenset[int]) -> Plan:
        """The plan without the obstacles that can stay as they are."""
        for gate in dict.fromkeys(step.gate for step in reversed(plan)):
            if gate in wanted:
                continue
            shorter = tuple(step for step in plan if step.gate != gate)
            rebuilt = self._replayed(shorter, sets, stages, wanted)
            if rebuilt is not None:
                plan = rebuilt
        return plan

    def _replayed(
        self, plan: Plan, sets: Sets, stages: Stages, wanted: frozenset[int]
    ) -> Plan | None:
        """Return the same steps with the current poses; None if they no longer suffice."""
        rebuilt = []
        for step in plan:
            need = self.problem.next_need(step.gate, stages)
            at = []
            for robot in step.group:
                here = self.problem.members[robot].graph.poses_on(need.regions)
                at.append(self.reach(robot, sets[robot], stages) & here)
            places = dict(zip(step.group, at, strict=True))
            if not all(at) or (need.together and not fits(self.problem, step.group, places)):
                return None
            fresh = Step(step.gate, step.need, step.group, tuple(at))
            rebuilt.append(fresh)
            sets, stages = self.after(fresh, sets, stages)
        return tuple(rebuilt) if self._done(sets, stages, wanted) else None


def fits(problem: Problem, group: tuple[int, ...], places: Mapping[int, Mask]) -> bool:
    """Whether a whole group can stand there simultaneously: robots in conflict on regions of
    their own (bipartite matching; others may share)."""
    crowd = [i for i in group if problem.conflicts[i] & set(group)]
    taken: dict[int, int] = {}

    def place(robot: int, tried: set[int]) -> bool:
        regions = problem.members[robot].graph.regions_of(places[robot])
        while regions:
            low = regions & -regions
            regions ^= low
            if low in tried:
                continue
            tried.add(low)
            other = taken.get(low)
            if other is None or place(other, tried):
                taken[low] = robot
                return True
        return False

    return all(place(robot, set()) for robot in crowd)
