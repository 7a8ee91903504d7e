"""SOLVE: an order in which robots resolve obstacles, so that every robot can continue in the end.

A robot is the set of poses that it may choose to be in; robots do not collide. A step fulfils one
need of one obstacle: a group of capable robots goes where it can be fulfilled. If the robots of a
need may act at different times, a step can also be one robot's part of it, since that robot may
then make way for the others. Resolving only opens paths, and a step after which each robot of the
group can return to all its former poses loses nothing. So such a step is taken immediately, and the
search branches only over irreversible choices. Without collisions the search fails iff no order of
moves and resolutions keeps every robot able to continue (docs/coordination.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import combinations

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.resolution.problem import BudgetExhaustedError, Problem, Stages
from safenav.world.poses import FAR, Mask

BUDGET = 20_000
"""Nodes of one search; the largest trees seen had three."""

Present = Mapping[int, tuple[int, ...]]
"""The robots that already serve each obstacle."""


class Step(Struct, frozen=True):
    """One need of one obstacle, fulfilled by ``group``; ``at``: the poses in which each robot may
    do so."""

    gate: int
    need: int
    group: tuple[int, ...]
    at: tuple[Mask, ...]


Plan = tuple[Step, ...]


class RankedStep(Struct, frozen=True):
    """A step that could come next, with its rank (lower is better). ``partial``: other robots do
    their part later."""

    step: Step
    lossless: bool
    rank: tuple[int, ...]
    partial: bool = False


class PoseSets(Struct, frozen=True):
    """The robots of a problem as ``sets`` of poses that each may choose to be in, with obstacles at
    their ``stages``; open ones are walls."""

    problem: Problem
    sets: tuple[Mask, ...]
    stages: Stages

    @classmethod
    def around(cls, problem: Problem, poses: tuple[int, ...], stages: Stages) -> PoseSets:
        """Each robot's strongly connected pose set; the search treats its members alike."""
        found = (
            member.graph.around(1 << pose, problem.allowed(i, stages))
            for i, (member, pose) in enumerate(zip(problem.members, poses, strict=True))
        )
        return cls(problem, tuple(found), stages)

    def reach(self, robot: int, poses: Mask) -> Mask:
        """Return the poses that a robot can reach from ``poses``."""
        allowed = self.problem.allowed(robot, self.stages)
        return self.problem.members[robot].graph.closure(poses, allowed)

    def spots(self, robot: int, regions: Mask) -> Mask:
        """Return the poses on ``regions`` that a robot can reach."""
        here = self.problem.members[robot].graph.poses_on(regions)
        return self.reach(robot, self.sets[robot]) & here

    def can_continue(self, robot: int) -> bool:
        """Whether a robot can continue forever."""
        live = self.problem.members[robot].live(self.problem.allowed(robot, self.stages))
        return bool(self.reach(robot, self.sets[robot]) & live)

    def done(self, wanted: frozenset[int]) -> bool:
        """Whether ``wanted`` is resolved and all robots can continue forever."""
        resolved = all(self.problem.resolved(gate, self.stages) for gate in wanted)
        return resolved and all(map(self.can_continue, range(len(self.sets))))

    def placed(self, robot: int, at: Mask) -> PoseSets:
        """Return the same with other poses of a robot."""
        return replace(self, sets=(*self.sets[:robot], at, *self.sets[robot + 1 :]))

    def after(self, step: Step) -> PoseSets:
        """Return the sets and stages after a step."""
        changed = list(self.sets)
        for robot, at in zip(step.group, step.at, strict=True):
            changed[robot] = at
        stages = self.problem.acted(step.gate, self.stages, step.group)
        return PoseSets(self.problem, tuple(changed), stages)


class Solver(Struct):
    """Solves one problem; results are kept for equal states. ``stopping``, called at each node,
    raises to end a search from outside.
    """

    problem: Problem
    stopping: Callable[[], None] = lambda: None
    budget: int = BUDGET
    _memo: dict[tuple[PoseSets, frozenset[int]], Plan | None] = field(default_factory=dict)
    _nodes: int = 0

    def feasible(self, now: PoseSets, wanted: frozenset[int] = frozenset()) -> bool:
        """Whether ``wanted`` can be resolved and all robots continue forever. Raises
        BudgetExhaustedError."""
        self._nodes = 0
        return self._solve(now, None, wanted, {}) is not None

    def plan(
        self, poses: tuple[int, ...], stages: Stages, wanted: frozenset[int], present: Present
    ) -> Plan | None:
        """Return the necessary steps, by the robots with the lowest bids, or by the ``present``
        helpers of an obstacle where they suffice; None if there is no plan. Raises
        BudgetExhaustedError."""
        self._nodes = 0
        now = PoseSets.around(self.problem, poses, stages)
        origins = PoseSets(self.problem, tuple(1 << pose for pose in poses), stages)
        found = self._solve(now, origins, wanted, present)
        return None if found is None else _pruned(found, now, wanted)

    def _solve(
        self, now: PoseSets, origins: PoseSets | None, wanted: frozenset[int], present: Present
    ) -> Plan | None:
        key = now, wanted
        if origins is None and key in self._memo:
            return self._memo[key]
        self._nodes += 1
        if self._nodes > self.budget:
            raise BudgetExhaustedError
        self.stopping()
        found: Plan | None = () if now.done(wanted) else None
        for option in options(now, origins, present) if found is None else ():
            step = option.step
            there = None if origins is None else origins.after(step)
            rest = self._solve(now.after(step), there, wanted, present)
            found = None if rest is None else (step, *rest)
            if found is not None or option.lossless:
                break  # it lost nothing, so no other step helps either
        if origins is None or found is None:
            self._memo[key] = found
        return found


def options(
    now: PoseSets, origins: PoseSets | None, present: Present, *, every: bool = False
) -> list[RankedStep]:
    """Return the steps that could come next, the best first. Only one lossless step per obstacle is
    returned, unless ``every`` one is wanted."""
    found = list[RankedStep]()
    for gate in now.problem.open(now.stages):
        found += _for_gate(gate, now, origins, present, every)
        sure = next((option for option in found if option.lossless), None)
        if origins is None and not every and sure is not None:
            return [sure]  # a lossless step suffices: no optimum is required
    return sorted(found, key=lambda option: (option.partial, not option.lossless, option.rank))


def _for_gate(
    gate: int, now: PoseSets, origins: PoseSets | None, present: Present, every: bool
) -> Iterator[RankedStep]:
    problem, stages = now.problem, now.stages
    need = problem.next_need(gate, stages)
    then = replace(now, stages=problem.advanced(gate, stages))
    places: dict[int, Mask] = {}
    ticks: dict[int, int] = {}
    for robot in problem.able(gate, stages):
        there = now.spots(robot, need.regions)
        if there:
            places[robot] = there
            if origins is not None:
                member, allowed = problem.members[robot], problem.allowed(robot, stages)
                steps = member.graph.steps_between(origins.sets[robot], there, allowed) or 0
                for further in problem.gates[gate].chain(stages[gate].need)[1:]:
                    goal = member.graph.poses_on(further.regions)
                    more = member.graph.steps_between(there, goal, allowed)
                    steps, there = steps + (FAR if more is None else more), goal
                ticks[robot] = steps * member.ticks
    helping = present.get(gate, ())
    others = (present.get(o, ()) for o in problem.open(stages) if o != gate)
    elsewhere = set[int]().union(*others)  # a robot that serves no other request is preferred
    able = sorted(places, key=lambda i: (i in elsewhere, i not in helping, ticks.get(i, 0), i))
    back = {i: not now.sets[i] & ~then.reach(i, places[i]) for i in able}
    able.sort(key=lambda i: not back[i])
    commits, missing = problem.commits(gate, stages), max(1, problem.missing(gate, stages))
    for group in combinations(able, missing):
        if need.together and not fits(problem, group, places):
            continue
        lossless = all(back[i] for i in group) and not commits
        slowest = max(ticks.get(i, 0) for i in group)
        strangers = sum(i not in helping for i in group)
        rank = gate, sum(i in elsewhere for i in group), strangers, slowest
        step = Step(gate, stages[gate].need, group, tuple(places[i] for i in group))
        yield RankedStep(step, lossless, (*rank, *group))
        if lossless and not every:
            return  # the first group is the best lossless one
    for i in able if missing > 1 and not need.together else ():
        lossless = not now.sets[i] & ~now.reach(i, places[i]) and not commits
        step = Step(gate, stages[gate].need, (i,), (places[i],))
        yield RankedStep(step, lossless, (ticks.get(i, 0), gate, i), partial=True)


def _pruned(plan: Plan, now: PoseSets, wanted: frozenset[int]) -> Plan:
    """The plan without the obstacles that need not be resolved."""
    for gate in dict.fromkeys(step.gate for step in reversed(plan)):
        if gate in wanted:
            continue
        shorter = tuple(step for step in plan if step.gate != gate)
        rebuilt = _replayed(shorter, now, wanted)
        if rebuilt is not None:
            plan = rebuilt
    return plan


def _replayed(plan: Plan, now: PoseSets, wanted: frozenset[int]) -> Plan | None:
    """Return the same steps with the current poses; None if they no longer suffice."""
    rebuilt = []
    for step in plan:
        need = now.problem.next_need(step.gate, now.stages)
        places = {robot: now.spots(robot, need.regions) for robot in step.group}
        together = need.together and not fits(now.problem, step.group, places)
        able = now.problem.able(step.gate, now.stages)  # full robots cannot take another load
        if together or not all(places.values()) or not {*step.group} <= {*able}:
            return None
        rebuilt.append(replace(step, at=tuple(places.values())))
        now = now.after(rebuilt[-1])
    return tuple(rebuilt) if now.done(wanted) else None


def fits(problem: Problem, group: tuple[int, ...], places: Mapping[int, Mask]) -> bool:
    """Whether a whole group can stand in its ``places`` simultaneously, robots in conflict in
    different regions (bipartite matching; others may share)."""
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
