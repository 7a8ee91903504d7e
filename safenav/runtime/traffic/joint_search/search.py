"""Joint plans: moves for all robots by which each reaches its targets, or a proof that none exist.

LaCAM (Okumura: LaCAM, search-based algorithm for quick multi-agent pathfinding, AAAI 2023) over
joint states: a depth-first search whose next state is PIBT's proposal, then PIBT with one robot
forced, then every step of one robot alone, so that it is complete with few edges per state. One
deep search makes needlessly long plans; many small ones, with other priorities and doubled budgets,
find short ones, and where the floor is full chains of legs find them (``by_legs``). States in which
some robot can no longer continue are left out. A search that exhausts its space without robots left
out is repeated with all states, which is the proof.
"""

from __future__ import annotations

import random
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from itertools import chain

from safenav.components import path_to
from safenav.runtime.resolution.problem import Stages
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.joint_search.immobile import ImmobileRobots
from safenav.runtime.traffic.joint_search.pibt import Field, Generator
from safenav.runtime.traffic.joint_search.states import (
    Answer,
    BudgetExhausted,
    Count,
    Course,
    Effort,
    Exhausted,
    Found,
    JointState,
)
from safenav.world.poses import FAR, Mask, region_mask

Guide = Callable[[Stages, tuple[int, ...]], Sequence[Mask | None]]
"""The goal poses that coordination gives each robot at stages and poses: a mask, 0 for none, None
for those of its own objective."""

Goal = Callable[[JointState], bool]


class Variant(Enum):
    """The order in which robots choose, and which of them have goal poses."""

    FARTHEST = "farthest first"
    STATIC = "a random order"
    ONE = "one goal at a time"


class Search:
    """Plans from one joint state. ``keeps``: whether a plan may lead through a state; ``stopping``
    raises to end a search from outside; ``work``: its limit besides the budgets of its variants
    (None: there is none)."""

    def __init__(
        self,
        course: Course,
        guide: Guide,
        start: JointState,
        goal: Goal,
        *,
        seed: int = 0,
        stopping: Callable[[], None] = lambda: None,
        work: Effort | None = None,
    ) -> None:
        self.course = course
        self.work = work or Effort(sys.maxsize)
        self.start = start
        self.goal = goal
        self.keeps: Goal = lambda _: True
        self._guide = guide
        self.rng = random.Random(seed)
        self.stopping = stopping
        self._guided: dict[Stages, Sequence[Mask | None]] = {}
        self._known: dict[Stages, dict[tuple[int, Count], Field]] = {}
        self._generator = Generator(course, self.rng)
        self._stuck = ImmobileRobots(course)
        self._immobile = self._stuck.robots(start.poses)

    def run(
        self,
        rounds: int = budgets.ROUNDS_OF_SEARCH,
        proof: int = budgets.PROOF_BUDGET,
        chain: int = budgets.CHAIN_BUDGET,
    ) -> Answer:
        """Return the first plan that a variant finds, cheap variants first. ``proof``, ``chain``:
        other budgets than the default."""
        if self.goal(self.start):
            return Found((self.start,))
        few = self._few
        if not few and self._stuck.cannot_complete(self.start):
            return BudgetExhausted()  # refuted in practice; the proof concerns the immobile robots
        budget = budgets.FIRST_BUDGET
        for turn in range(max(1, rounds)):
            if self.work.done:
                return BudgetExhausted()
            for variant, states in _attempts(budget):
                answer = self.by(variant, states)
                if isinstance(answer, Found):
                    return answer
                if isinstance(answer, Exhausted):
                    # This also visits the hopeless states, hardly more than were examined.
                    return self.singles(proof or budgets.PROOF_BUDGET)
            answer = by_legs(self, chain << turn)
            if isinstance(answer, Found):
                return answer
            if turn == 0 and few:
                answer = self.singles(min(budgets.SINGLES_BUDGET, proof))
                if not isinstance(answer, BudgetExhausted):
                    return answer
            budget *= 2
        if few and proof > budgets.SINGLES_BUDGET:
            return self.singles(proof)
        return BudgetExhausted()

    @property
    def _few(self) -> bool:
        """Return whether all joint states of the team may be searched."""
        return len(self.start.poses) <= 4

    def refuted(self) -> bool:
        """Return whether it can be shown quickly that no plan exists: in a large team because
        robots block each other forever."""
        if self._few:
            return isinstance(self.run(*budgets.CERTIFICATE), Exhausted)
        return bool(self._stuck.cannot_complete(self.start))

    def singles(self, budget: int) -> Answer:
        """Search all states breadth first by steps of one robot: a shortest plan, or the proof that
        none exists."""
        course = self.course
        before = {self.start: self.start}
        queue = deque([self.start])
        while queue:
            self.stopping()
            state = queue.popleft()
            for robot, pose in course.singles(state):
                after = course.after(state, robot, pose)
                if after in before or not self.keeps(after):
                    continue
                before[after] = state
                if self.goal(after):
                    return Found(path_to(after, before))
                queue.append(after)
                self.work.left -= len(state.poses)
            if len(before) > budget or self.work.done:
                return BudgetExhausted()
        return Exhausted(frozenset(before))

    def by(self, variant: Variant, budget: int) -> Answer:
        """Run one variant of the search for at most ``budget`` states."""
        order = list(range(len(self.start.poses)))
        if variant in (Variant.STATIC, Variant.ONE):
            self.rng.shuffle(order)
        return self.depth_first(self.start, self.goal, budget, variant, order)

    def depth_first(
        self, start: JointState, goal: Goal, budget: int, variant: Variant, order: list[int]
    ) -> Answer:
        """Search from a start for a goal. With ``ONE`` goal at a time only the first robot of
        ``order`` that has goal poses pursues them, and all others give way."""
        before = {start: start}
        stack = [(start, self._following(start, variant, order))]
        edges = 0
        while stack:
            self.stopping()
            state, following = stack[-1]
            after = next(following, None)
            if after is None:
                stack.pop()
                continue
            edges += 1
            if edges > budget * 12 or self.work.done:
                return BudgetExhausted()
            if after in before:
                continue
            before[after] = state
            if goal(after):
                return Found(path_to(after, before))
            if len(before) > budget:
                return BudgetExhausted()
            stack.append((after, self._following(after, variant, order)))
        return Exhausted(frozenset(before))

    def _following(
        self, state: JointState, variant: Variant, order: list[int]
    ) -> Iterator[JointState]:
        """Yield the possible next states that are not known to be hopeless."""
        for after in self._proposed(state, variant, order):
            if self.keeps(after) and not self._stuck.cannot_complete(after):
                yield after

    def _proposed(
        self, state: JointState, variant: Variant, order: list[int]
    ) -> Iterator[JointState]:
        """Yield the possible next states: proposals first, then every step of one robot."""
        course = self.course
        fields = self.fields(state)
        if variant is Variant.ONE:
            first = next((i for i in order if fields[i] is not None), None)
            fields = [field if i == first else None for i, field in enumerate(fields)]
        poses = state.poses

        def urgency(robot: int) -> tuple[int, int]:
            field = fields[robot]
            if field is None:
                return 1, 0
            ahead = field[poses[robot]]
            return 0, -ahead if ahead < FAR else 0

        if variant is not Variant.STATIC:
            order = sorted(order, key=urgency)
        everybody = range(len(poses))
        self.work.left -= len(poses)
        found = self._generator.propose(state, fields, order)
        if found is not None and found != poses:
            yield course.moved(state, found, everybody)
        hopeful = course.hopeful(state.stages)
        for robot in order:
            for pose in hopeful[robot][poses[robot]]:
                self.work.left -= len(poses)
                found = self._generator.propose(state, fields, order, (robot, pose))
                if found is not None:
                    yield course.moved(state, found, everybody)
        for robot, pose in course.singles(state):
            if pose in hopeful[robot][poses[robot]]:
                self.work.left -= len(poses)
                yield course.after(state, robot, pose)

    def fields(self, state: JointState) -> list[Field]:
        """Return for each robot the distances to its goal poses in a state."""
        guided = self._guided.get(state.stages)
        if guided is None:
            guided = self._guided[state.stages] = self._guide(state.stages, state.poses)
        known = self._known.setdefault(state.stages, {})
        found: list[Field] = []
        for robot, goals in enumerate(guided):
            count = state.counts[robot]
            key = robot, count
            if key in known:
                field = known[key]
            else:
                goal = self.course.awaited(robot, count) if goals is None else goals
                field = known[key] = self._field(robot, goal, state.stages)
            near = field is not None and field[state.poses[robot]] < FAR
            found.append(field if near else None)
        return found

    def _field(self, robot: int, goal: Mask, stages: Stages) -> Field:
        problem = self.course.problem
        if not goal:
            return None
        graph = problem.members[robot].graph
        rivals = self._immobile & problem.conflicts[robot]
        places = region_mask(self.start.poses[i] % problem.members[i].graph.size for i in rivals)
        free = graph.everywhere & ~graph.poses_on(places)
        return graph.distances(goal & free, problem.allowed(robot, stages) & free)


def _attempts(budget: int) -> Iterator[tuple[Variant, int]]:
    """Yield the variants of a round with their budgets. Variants with a random order try many
    orders briefly rather than one for long: a good order needs few states, a bad one any number."""
    for variant in Variant:
        drawn = variant in (Variant.STATIC, Variant.ONE)
        times = max(1, budget // budgets.MOST_FOR_AN_ORDER) if drawn else 1
        for _ in range(times):
            yield variant, budget // times


def by_legs(search: Search, most_vain: int) -> Found | BudgetExhausted:
    """Return one chain from the start of a search to its goal. ``most_vain``: limit on states
    examined without success. The next robot is drawn at random, and how far to backtrack if no leg
    leads further.

    On full floors one search for all robots together makes no progress; a leg for one robot, with
    all others pushed aside, takes some ten states. Any robot that succeeds may be the next. A chain
    that ends in a state from which no leg leads further backtracks to an earlier one, and continues
    by other legs.
    """
    legs: list[tuple[JointState, ...]] = [(search.start,)]
    most = budgets.LEGS_OF_A_ROBOT * len(search.start.poses)
    spent, made = 0, 0
    while not search.goal(legs[-1][-1]):
        leg, vain = _next_leg(search, legs[-1][-1])
        spent += vain
        made += 1
        over = spent > most_vain or made > most or search.work.done
        if over or (leg is None and len(legs) == 1):
            return BudgetExhausted()
        if leg is None:
            del legs[search.rng.randrange(1, len(legs)) :]
        else:
            legs.append(leg)
    return Found((search.start, *chain.from_iterable(leg[1:] for leg in legs[1:])))


def _next_leg(search: Search, state: JointState) -> tuple[tuple[JointState, ...] | None, int]:
    """Return the states until some robot reaches its current goal poses, and the number of states
    examined without success."""
    fields = search.fields(state)
    wanting = [i for i, field in enumerate(fields) if field is not None and field[state.poses[i]]]
    search.rng.shuffle(wanting)
    vain = 0
    for robot in wanting:
        others = [other for other in range(len(fields)) if other != robot]
        search.rng.shuffle(others)
        field = fields[robot]
        assert field is not None
        budget = budgets.LEG_BUDGET + 2 * field[state.poses[robot]]
        goal = _reached(search, state, robot)
        answer = search.depth_first(state, goal, budget, Variant.ONE, [robot, *others])
        if isinstance(answer, Found):
            return answer.states, vain
        vain += budget
    return None, vain


def _reached(search: Search, start: JointState, robot: int) -> Goal:
    """Return a test whether a robot has reached its goal poses of ``start``, the stages or its
    count have changed, or the goal of the search is reached."""
    field = search.fields(start)[robot]
    assert field is not None

    def reached(state: JointState) -> bool:
        if state.stages != start.stages or state.counts[robot] != start.counts[robot]:
            return True
        return field[state.poses[robot]] == 0 or search.goal(state)

    return reached
