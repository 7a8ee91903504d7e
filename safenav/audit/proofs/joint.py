"""Joint proofs: robots that share a floor cannot complete the mission, whatever each does.

The joint states are enumerated again: each robot's pose and remaining goals, and the stage of each
obstacle. One robot moves at a time, into a region that no robot in conflict with it occupies. A
proof is accepted if no reachable state completes the mission, and the reachable poses are those
that the proof counts.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from heapq import heappop, heappush
from itertools import product
from typing import Any, NamedTuple

from safenav.audit.language import Pose
from safenav.audit.needs import OpenObstacle, OpenObstacles
from safenav.audit.possibilities.team import TooManyError
from safenav.audit.proofs.case import Case, RemainingGoals, plain

MOST_STATES = 200_000

Left = tuple[int, int]
"""Remaining work of a robot. In order: the number of goals left, and the next one (``EITHER``: the
one that it meets first). In any order: the rounds left, and a bit mask of the targets covered."""
EITHER = -1
ELSEWHERE = -1
"""Stands for all regions that are irrelevant to the obstacles."""


class _State(NamedTuple):
    poses: tuple[Pose, ...]
    left: tuple[Left, ...]
    obstacles: OpenObstacles

    @property
    def rank(self) -> int:
        """The number of goals or rounds left. States with fewer are examined first: that refutes a
        false proof early."""
        return sum(goals for goals, _ in self.left)


def joint_problems(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Yield the errors of a joint proof. Raises TooManyError."""
    listed, stated = proof["robots"], proof["states"]
    start = {name: tuple(pose) for name, pose in proof["start"].items()}
    stages = {name: stage for name, stage in proof["stages"].items() if name not in case.shut}
    strangers = sorted({*listed, *start} - case.at.keys())
    if strangers or not listed:
        yield f"the proof names {', '.join(strangers) or 'no robots'}"
        return
    for name in listed:
        if start.get(name) != plain(case.at[name]):
            yield f"{name} is at {plain(case.at[name])}, not where the proof begins"
            return
    problem = _stages_problem(stages, {*listed}, case)
    if problem:
        yield problem
        return
    if stated > MOST_STATES:
        raise TooManyError(f"{stated} states exceed the {MOST_STATES} that the audit enumerates")
    robots = [name for name in case.at if name in listed]
    known = (obstacle for obstacle in case.obstacles if obstacle.name in stages)
    yield from _Enumeration(case, robots, tuple(known)).problems(stated, proof["sha256"])


def room_problems(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Yield the errors of a proof that robots have no room at their last targets."""
    robots = {*proof["robots"]}
    if not robots or robots - case.at.keys():
        yield f"the proof names {', '.join(sorted(robots - case.at.keys())) or 'no robots'}"
        return
    for name in sorted(robots):
        if not case.remaining[name].settles:
            yield f"{name} does not have to stay at a target"
            return
        if others := sorted(robots - case.team.members[name].rivals - {name}):
            yield f"{name} and {others[0]} may share a region"
            return
    regions = {region for name in robots for region, _ in case.remaining[name].targets[-1]}
    if len(regions) >= len(robots):
        yield f"there is room at {', '.join(map(str, sorted(regions)))} for {len(robots)} robots"


def _stages_problem(stages: Mapping[str, int], listed: set[str], case: Case) -> str:
    for name, stage in stages.items():
        obstacle = case.obstacle(name)
        if obstacle is None:
            return f"{name} is unknown or already resolved, so it blocks no robot"
        if stage != obstacle.stage:
            return f"{name} has {obstacle.stage} of its needs fulfilled, not {stage}"
        able = frozenset[str]().union(*(need.able for need in obstacle.left))
        helper = next((other for other in case.at if other in able - listed), None)
        if helper is not None:
            return f"{helper}, which the proof omits, may help to resolve {name}"
    return ""


def can_be_served(names: Collection[str], case: Case, most: int) -> bool | None:
    """Return whether the robots can complete the mission with these obstacles resolved; None if
    there are more than ``most`` joint states."""
    every, served = _Enumeration(case, [*case.at], case.obstacles), {*names}

    def serves(state: _State) -> bool:
        open_ = {obstacle.name for obstacle in state.obstacles}
        return not served & open_ and every.is_complete(state)

    return every.reaches(serves, most)


def can_get(robot: str, regions: Collection[int], case: Case, most: int) -> bool | None:
    """Return whether the team's moves can bring a robot to one of the regions; None if there are
    more than ``most`` joint states."""
    every, index = _Enumeration(case, [*case.at], case.obstacles), [*case.at].index(robot)
    return every.reaches(lambda state: state.poses[index][0] in regions, most)


class _Enumeration:
    def __init__(self, case: Case, robots: list[str], obstacles: OpenObstacles) -> None:
        self._case, self._team, self._robots = case, case.team, robots
        self._remaining = [case.remaining[name] for name in robots]
        self._obstacles = obstacles
        # Cached, because most moves concern no relevant region.
        self._relevant_regions = cache(_relevant_regions)
        self._after_acting, self._walls = cache(self._performed), cache(self._team.walls)

    def reaches(self, is_wanted: Callable[[_State], bool], most: int) -> bool | None:
        """Return whether a wanted state is reachable; None beyond ``most`` states."""
        for state, seen in self._reached():
            if is_wanted(state):
                return True
            if seen > most:
                return None
        return False

    def problems(self, stated: int, digest: object) -> Iterator[str]:
        poses = set[tuple[Pose, ...]]()
        for state, seen in self._reached():
            poses.add(tuple(map(plain, state.poses)))
            if self.is_complete(state):
                at = zip(self._robots, state.poses, strict=True)
                places = ", ".join(f"{name} at {region}" for name, (region, _) in at)
                yield f"the mission can be completed: every objective is met with {places}"
                return
            if seen > MOST_STATES:
                raise TooManyError(f"more than {MOST_STATES} states: too many for the audit")
            if len(poses) > stated:
                yield f"more states are reachable than the {stated} of the proof"
                return
        if len(poses) != stated:
            yield f"{len(poses)} states are reachable, not {stated}"
        elif digest != _digest(poses):
            yield "the reachable states are not those of the proof (sha256)"

    def _reached(self) -> Iterator[tuple[_State, int]]:
        """Yield the reachable states, those with the least rank first, each with the number of
        states found before it was examined."""
        queue, seen, after = list[tuple[int, int, _State]](), set[_State](), iter(self._starts())
        while True:
            for found in after:
                if found not in seen:
                    seen.add(found)
                    heappush(queue, (found.rank, len(seen), found))
            if not queue:
                return
            _, _, state = heappop(queue)
            yield state, len(seen)
            after = self._successors(state)

    def _starts(self) -> list[_State]:
        choices: list[list[Left]] = []
        for own in self._remaining:
            count = len(own.targets)
            if own.ends:
                (first,) = own.awaited
                choices.append([((count - first) * (own.rounds_left > 0), first)])
            elif own.in_order:
                goals = max(own.rounds_left * count - own.met, 0)
                either = own.either and len(own.awaited) == count  # an early start loses nothing
                choices.append([(goals, k) for k in ((EITHER,) if either else own.awaited)])
            else:
                choices.append([(own.rounds_left, sum(1 << k for k in own.covered))])
        poses = tuple(self._case.at[name] for name in self._robots)
        return [self._settled(_State(poses, left, self._obstacles)) for left in product(*choices)]

    def _successors(self, state: _State) -> Iterator[_State]:
        at = dict(zip(self._robots, state.poses, strict=True))
        for k, name in enumerate(self._robots):
            member = self._team.members[name]
            taken = {at[other][0] for other in member.rivals if other in at}
            for group, zone in self._case.zones:
                mates = [other for other in at if other != name and other in group]
                if name in group and any(at[other][0] in zone for other in mates):
                    taken |= zone
            taken |= self._walls(name, state.obstacles)
            for to in member.steps.get(at[name], ()):
                if to[0] not in taken:
                    poses = (*state.poses[:k], to, *state.poses[k + 1 :])
                    yield self._settled(_State(poses, state.left, state.obstacles), k)

    def is_complete(self, state: _State) -> bool:
        """Return whether each robot has met all goals, is at its last target if it settles there,
        and can continue forever."""
        if any(goals for goals, _ in state.left):
            return False
        each = zip(self._robots, self._remaining, state.poses, strict=True)
        return all(
            (not own.settles or pose in own.targets[-1])
            and self._team.is_live(name, pose, state.obstacles)
            for name, own, pose in each
        )

    def _settled(self, state: _State, moved: int | None = None) -> _State:
        """Return the state after all actions, then all goals, of the robots where they stand. Only
        the robot that has ``moved`` can meet a goal, unless an obstacle is resolved."""
        after = self._after_acting(state.obstacles, self._places(state))
        obstacles, left = tuple(obstacle for obstacle in after if obstacle.left), state.left
        restarts = any(not each.left and each.order[0] != self._case.flat for each in after)
        if moved is not None and not restarts:
            met = _met(self._remaining[moved], state.poses[moved], left[moved])
            return _State(state.poses, (*left[:moved], met, *left[moved + 1 :]), obstacles)
        if restarts:
            left = tuple(map(self._anew, self._remaining, left))
        left = tuple(map(_met, self._remaining, state.poses, left))
        return _State(state.poses, left, obstacles)

    def _places(self, state: _State) -> tuple[int, ...]:
        """Return each robot's region, or ``ELSEWHERE``."""
        concerned = self._relevant_regions(state.obstacles)
        return tuple(r if r in concerned else ELSEWHERE for r, _ in state.poses)

    def _performed(self, obstacles: OpenObstacles, places: tuple[int, ...]) -> OpenObstacles:
        """Return the obstacles after all actions that the robots can perform where they stand.
        Loads are taken last, in their order, by robots that can carry one more."""
        at = dict(zip(self._robots, places, strict=True))
        after = [_performed(obstacle, at, None) for obstacle in obstacles]
        loads = [k for k, obstacle in enumerate(after) if obstacle.takes()]
        for k in sorted(loads, key=lambda k: after[k].order):
            after[k] = _performed(after[k], at, self._team.full(after))
        return tuple(after)

    def _anew(self, own: RemainingGoals, left: Left) -> Left:
        """Return the remaining work after a resolution: rounds restart. The order of the targets is
        kept, but either of the two targets of a strict objective may come first."""
        rounds, count = self._case.rounds, len(own.targets)
        if own.ends:
            return count - left[1], left[1]
        if not own.in_order:
            return rounds, 0
        return rounds * count, EITHER if own.either else left[1]


def _relevant_regions(obstacles: OpenObstacles) -> frozenset[int]:
    """Return the regions where robots resolve an obstacle, and those of obstacles."""
    there = frozenset(obstacle.region for obstacle in obstacles)
    needs = (need.regions for obstacle in obstacles for need in obstacle.left)
    return there.union(*needs)


def _performed(
    obstacle: OpenObstacle, at: Mapping[str, int], full: frozenset[str] | None
) -> OpenObstacle:
    """Return an obstacle after the actions that the robots can perform where they stand. ``full``:
    robots that can take no other load; None: no robot takes one now."""
    while obstacle.left:
        need, takes = obstacle.left[0], obstacle.takes()
        if takes and full is None:
            return obstacle
        able = (need.able - obstacle.barred - need.cut_off) & at.keys()
        if takes:
            able -= full or frozenset()
        group = frozenset(name for name in able if at[name] in need.regions)
        if takes and not need.together:  # one after the other, in the order of their turns
            missing = need.robots - len(obstacle.done)
            group = frozenset([name for name in at if name in group - obstacle.done][:missing])
        group |= frozenset() if need.together else obstacle.done
        if len(group) < need.robots:
            return obstacle if need.together else obstacle._replace(done=group)
        obstacle = obstacle.advanced(group)
    return obstacle


def _met(own: RemainingGoals, pose: Pose, left: Left) -> Left:
    goals, covered = left  # in order: the next goal
    count = len(own.targets)
    if own.in_order:
        if covered == EITHER:
            covered = next((k for k, t in enumerate(own.targets) if pose in t), EITHER)
        while goals and covered != EITHER and pose in own.targets[covered]:
            last = own.ends and covered == count - 1
            goals, covered = goals - 1, covered if last else (covered + 1) % count
        return goals, covered
    here = sum(1 << k for k, target in enumerate(own.targets) if pose in target)
    while goals:
        covered |= here
        if covered != (1 << count) - 1:
            return goals, covered
        goals, covered = goals - 1, 0
    return 0, 0


def _digest(poses: set[tuple[Pose, ...]]) -> str:
    lines = sorted(
        json.dumps([[region, heading] for region, heading in one], separators=(",", ":")) + "\n"
        for one in poses
    )
    return hashlib.sha256("".join(lines).encode()).hexdigest()
