"""Plans that fulfil the next need of an obstacle as early as possible, for requests with a
deadline.

Turn by turn in the order of the team: first the possible helpers move and all others stay parked,
then also the robot nearest to the path, then two. The search is A*, with a lower bound for helpers
that do not hinder each other; a plan that attains this bound is optimal for the whole team.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import count as counting

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.resolution.problem import Floor, OpenNeed, Problem, Stages
from safenav.runtime.traffic.budgets import MOST_HELPERS, TIMED_STATES
from safenav.world.poses import FAR, Mask, region_mask

Robot = tuple[int, int, int]
"""A robot's pose, its destination, and the remaining ticks of its step (0: it has arrived)."""
State = tuple[tuple[Robot, ...], frozenset[int]]
"""The moving robots, and the robots that have taken part in the need."""


Poses = tuple[int, ...]


class Quickest(Struct, frozen=True, eq=False, dict=True):
    """Searches from ``poses`` for the next need of an obstacle (``gate``). ``movers``: the robots
    that move in the present search; all others are parked."""

    problem: Problem
    stages: Stages
    poses: tuple[int, ...]
    gate: int
    stopping: Callable[[], None] = lambda: None
    movers: Sequence[int] = ()

    @cached_property
    def _need(self) -> OpenNeed:
        return self.problem.next_need(self.gate, self.stages)

    @cached_property
    def _missing(self) -> int:
        return self.problem.missing(self.gate, self.stages)

    @cached_property
    def _able(self) -> frozenset[int]:
        return frozenset(self.problem.able(self.gate, self.stages))

    def plan(self) -> list[Poses] | None:
        """Return the joint poses of the earliest plan found, the present ones first, then those
        after each tick; None if there is none, or the budget is exhausted."""
        everybody = replace(self, movers=range(len(self.poses)))
        reach = sorted(
            (field[self.poses[i]] * self.problem.members[i].ticks, i)
            for i, field in everybody._fields.items()
            if field[self.poses[i]] < FAR
        )
        if len(reach) < self._missing:
            return None
        least = reach[self._missing - 1][0]
        movers = [i for _, i in reach[: max(MOST_HELPERS, self._missing)]]
        others = everybody._by_nearness(movers)
        best: list[Poses] | None = None
        for more in range(min(2, len(others)) + 1):
            most = FAR if best is None else len(best) - 2
            moving = replace(self, movers=sorted((*movers, *others[:more])))
            best = moving._search(most) or best
            if best is not None and len(best) - 1 <= least:  # no robot blocks another
                break
        return best

    @cached_property
    def _fields(self) -> dict[int, list[int]]:
        """The steps from each pose to the need's regions, for the movers that can fulfil it."""
        found = {}
        for i in sorted(self._able.intersection(self.movers)):
            graph, allowed = self.problem.members[i].graph, self._allowed[i]
            goal = graph.poses_on(self._need.regions) & (allowed | 1 << self.poses[i])
            found[i] = graph.distances(goal, allowed)
        return found

    @cached_property
    def _allowed(self) -> dict[int, Mask]:
        """The poses that each mover may take: parked robots are walls."""
        found = {}
        for i in self.movers:
            parked = self.problem.conflicts[i].difference(self.movers)
            walls = region_mask(self._region(other, self.poses[other]) for other in parked)
            graph = self.problem.members[i].graph
            found[i] = self.problem.allowed(i, self.stages) & ~graph.poses_on(walls)
        return found

    def _region(self, robot: int, pose: int) -> int:
        return pose % self.problem.members[robot].graph.size

    def _by_nearness(self, movers: Sequence[int]) -> list[int]:
        """Return the other robots that can block a mover, the nearest to its path first."""
        paths = 0
        for i in movers:
            graph, pose, field = self.problem.members[i].graph, self.poses[i], self._fields[i]
            while 0 < field[pose] < FAR:
                pose = min(graph.steps(pose), key=lambda q: field[q])
                paths |= 1 << pose % graph.size
        rivals = {r for i in movers for r in self.problem.conflicts[i]}.difference(movers)
        found = []
        for i in sorted(rivals):
            graph = self.problem.members[i].graph
            away = graph.steps_between(1 << self.poses[i], graph.poses_on(paths), self._allowed[i])
            found.append((FAR if away is None else away, i))
        return [i for _, i in sorted(found)]

    def _search(self, most: int) -> list[Poses] | None:
        most = min(most, FAR - 1)
        here = tuple((self.poses[i], self.poses[i], 0) for i in self.movers)
        start: State = (here, frozenset())
        before: dict[tuple[State, int], tuple[State, int] | None] = {(start, 0): None}
        ticket = counting()
        first = self._bound(start, 0)
        heap = [(first, 0, next(ticket), 0, start)]
        seen: dict[tuple[State, int], int] = {}
        while heap:
            bound, _, _, turn, state = heapq.heappop(heap)
            if bound > most or len(seen) > TIMED_STATES:
                return None
            at = turn % len(self.movers)
            if seen.get((state, at), FAR) <= turn:
                continue
            seen[state, at] = turn
            self.stopping()
            for after in self._after(state, at):
                key = (after, turn + 1)
                if key in before:
                    continue
                before[key] = (state, turn)
                if self._met(after):
                    return self._ways(before, key)
                ahead = self._bound(after, turn + 1)
                if ahead <= most:
                    heapq.heappush(heap, (ahead, -turn, next(ticket), turn + 1, after))
        return None

    def _after(self, state: State, at: int) -> Iterator[State]:
        """Yield the states after the turn of a mover: it stays, begins a step or continues one, and
        takes part in the need if it is in one of its regions."""
        robots, done = state
        pose, to, left = robots[at]
        robot = self.movers[at]
        if left:
            options = [(to, to, 0) if left == 1 else (pose, to, left - 1)]
        else:
            member, closed = self.problem.members[robot], self._closed(robots, robot)
            options = [(pose, pose, 0)]
            for step in member.graph.steps(pose):
                if self._allowed[robot] >> step & 1 and not closed >> step % member.graph.size & 1:
                    ticks = member.ticks - 1
                    options.append((pose, step, ticks) if ticks else (step, step, 0))
        for option in options:
            there = option[0] if option[2] == 0 else pose
            after, part = (*robots[:at], option, *robots[at + 1 :]), done
            if not self._need.together and robot in self._able and self._is_there(robot, there):
                part = done | {robot}
            yield after, part

    def _closed(self, robots: tuple[Robot, ...], robot: int) -> Mask:
        """Return the regions that a robot must not enter because of others."""
        now, then = list(self.poses), list(self.poses)
        for other, (pose, to, _) in zip(self.movers, robots, strict=True):
            now[other], then[other] = pose, to
        return self.problem.separation.closed(robot, now, then)

    def _is_there(self, robot: int, pose: int) -> bool:
        return bool(self._need.regions >> self._region(robot, pose) & 1)

    def _met(self, state: State) -> bool:
        robots, done = state
        if not self._need.together:
            return len(done) >= self._missing
        here = dict(zip(self.movers, (pose for pose, _, _ in robots), strict=True))
        there = sum(self._is_there(i, here.get(i, self.poses[i])) for i in self._able)
        return there >= self._missing

    def _bound(self, state: State, turn: int) -> int:
        """Return a lower bound on the ticks of a plan through a state."""
        robots, done = state
        tick, had = divmod(turn, len(self.movers))
        ends = []
        for at, (robot, (_, to, left)) in enumerate(zip(self.movers, robots, strict=True)):
            if robot in self._able and robot not in done:
                away = self._fields[robot][to]
                ticks = left + away * self.problem.members[robot].ticks
                acts = 0 if self._need.together and not ticks else max(1, ticks)
                ends.append(tick + (at < had) + acts if away < FAR else FAR)
        ends += [tick] * len(done)
        if self._need.together:
            parked = self._able.difference(self.movers)
            ends += [tick for i in parked if self._is_there(i, self.poses[i])]
        ends.sort()
        return ends[self._missing - 1] if len(ends) >= self._missing else FAR

    def _ways(
        self,
        before: dict[tuple[State, int], tuple[State, int] | None],
        last: tuple[State, int],
    ) -> list[Poses]:
        """Return the joint poses after each tick of the path to a state."""
        found: list[Poses] = []
        key: tuple[State, int] | None = last
        while key is not None:
            (robots, _), turn = key
            if key is last or turn % len(self.movers) == 0:
                poses = list(self.poses)
                for robot, (pose, _, _) in zip(self.movers, robots, strict=True):
                    poses[robot] = pose
                found.append(tuple(poses))
            key = before[key]
        return found[::-1]


def keeping_out(floor: Floor, regions: Sequence[Mask]) -> Floor:
    """Return the same floor with regions that each robot must not enter."""
    members = tuple(
        replace(member, floor=member.floor & ~member.graph.poses_on(closed) | 1 << pose)
        for member, pose, closed in zip(floor.problem.members, floor.poses, regions, strict=True)
    )
    return replace(floor, problem=replace(floor.problem, members=members))


def beside(floor: Floor, plan: Sequence[Poses], goals: Sequence[Mask]) -> list[Poses]:
    """Return a plan in which robots that were parked approach their goals (0: none), one after the
    other, as far as they block no other robot."""
    problem = floor.problem
    paths = [list(path) for path in zip(*plan, strict=True)]
    still = [i for i, path in enumerate(paths) if len(set(path)) == 1 and goals[i]]
    for robot in still if not problem.zones else ():
        member = problem.members[robot]
        if member.ticks > 1 or (member.turns and problem.interferes(robot)):
            continue  # it might not be able to return
        allowed, size = problem.allowed(robot, floor.stages), member.graph.size
        field = member.graph.distances(goals[robot] & allowed, allowed)
        path = [floor.poses[robot]]
        for tick in range(1, len(plan)):
            taken = {
                pose % problem.members[other].graph.size
                for other in problem.conflicts[robot]
                for pose in paths[other][tick - 1 :]
            }
            open_ = [
                pose
                for pose in member.graph.steps(path[-1])
                if allowed >> pose & 1 and pose % size not in taken
            ]
            nearest = min(open_, key=lambda pose: field[pose], default=path[-1])
            path.append(nearest if field[nearest] < min(field[path[-1]], FAR) else path[-1])
        paths[robot] = path
    return [tuple(poses) for poses in zip(*paths, strict=True)]
