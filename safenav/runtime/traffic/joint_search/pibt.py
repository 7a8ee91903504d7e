"""PIBT: one simultaneous step for a whole team, robots pushing those that stand in their way.

Priority inheritance with backtracking (Okumura, Machida, Defago, Tamura: Priority inheritance with
backtracking for iterative multi-agent path finding, Artificial Intelligence 310, 2022), over poses
instead of places. Each robot takes the pose nearest to its goal poses; a robot that stands there
steps first, and if it cannot, the next best pose is tried. Robots move one after the other within a
tick, so a robot may enter a region that is left in the same step, but closed cycles do not rotate:
no robot moves into the region of a robot that waits for it to move. If the first robot waits for
other regions of a zone (``Zones``), the robots there leave first.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from itertools import pairwise

from safenav.runtime.traffic.joint_search.states import Course, JointState
from safenav.world.poses import Mask

Field = list[int] | None
"""The distance of each pose to a robot's goal poses; None if it has none."""

Rank = tuple[int, bool, int]
"""Rank of a pose: its distance from the goal poses, whether a robot stands there, its number."""


class Generator:
    """Proposes joint steps. ``rng`` breaks ties."""

    def __init__(self, course: Course, rng: random.Random) -> None:
        self._course = course
        self._rng = rng
        self._sizes = [member.graph.size for member in course.problem.members]
        self._conflicts = course.problem.conflicts
        self._state: JointState | None = None
        self._fields: Sequence[Field] = ()

    def propose(
        self,
        state: JointState,
        fields: Sequence[Field],
        order: Sequence[int],
        forced: tuple[int, int] | None = None,
    ) -> tuple[int, ...] | None:
        """The poses after one joint step, robots choosing in ``order``; ``forced`` is a robot and
        the pose that it must take. None if that is impossible. ``fields`` must not be changed
        between proposals for a state."""
        if state is not self._state or fields is not self._fields:
            self._look(state, fields, order)
        self._next: dict[int, int] = {}
        self._entered: dict[int, list[int]] = {}
        self._trail: list[int] = []
        if forced is not None and not self._place(forced[0], frozenset(), (forced[1],)):
            return None
        for robot in (*self._evicted, *order):
            if robot not in self._next and not self._place(robot, frozenset()):
                return None
        return tuple([self._next[robot] for robot in range(len(state.poses))])

    def _look(self, state: JointState, fields: Sequence[Field], order: Sequence[int]) -> None:
        """Prepare the data that all proposals for a state share."""
        self._state, self._fields = state, fields
        self._poses = state.poses
        self._regions = [p % size for p, size in zip(state.poses, self._sizes, strict=True)]
        self._now: dict[int, list[int]] = {}
        for robot, region in enumerate(self._regions):
            self._now.setdefault(region, []).append(robot)
        self._steps = self._course.hopeful(state.stages)
        self._zones = self._course.problem.zones
        self._ranked: dict[int, tuple[list[Rank], list[int] | None]] = {}
        self._evicted: dict[int, Mask] = {}
        self._claimed: list[tuple[frozenset[int], Mask]] = []
        if self._zones:
            self._make_way(order)

    def _make_way(self, order: Sequence[int]) -> None:
        """Let others leave, and keep out of, the regions in which they block the first robot with
        goal poses from its best next pose: it cannot push them from there."""
        poses, fields = self._poses, self._fields
        wanting = ((i, field) for i in order if (field := fields[i]) is not None)
        first = next((i for i, field in wanting if field[poses[i]]), None)
        if first is None:
            return
        region = self._candidates(first)[0] % self._sizes[first]
        if region == self._regions[first]:
            return
        for robots, zone in self._zones:
            if first in robots and zone >> region & 1:
                self._claimed.append((robots - {first}, zone))
                for other in robots - {first}:
                    if zone >> self._regions[other] & 1:
                        self._evicted[other] = zone

    def _place(
        self, robot: int, waiting: frozenset[int], only: Sequence[int] | None = None
    ) -> bool:
        """Choose a robot's next pose; ``waiting``: the robots that push it, directly or not."""
        trail = self._trail
        for pose in only or self._candidates(robot):
            mark = len(trail)
            if self._take(robot, pose, waiting):
                return True
            while len(trail) > mark:
                undone = trail.pop()
                self._entered[self._next.pop(undone) % self._sizes[undone]].remove(undone)
        return False

    def _take(self, robot: int, pose: int, waiting: frozenset[int]) -> bool:
        region = pose % self._sizes[robot]
        if self._zones and self._kept_out(robot, region):
            return False
        conflicts, following = self._conflicts[robot], self._next
        entered = self._entered.get(region)
        if entered is not None:
            for other in entered:
                if other in conflicts:
                    return False
        pushed = []
        if region != self._regions[robot]:
            for other in self._now.get(region, ()):
                if other not in conflicts:
                    continue
                if other in waiting:
                    return False
                after = following.get(other)
                if after is None:
                    pushed.append(other)
                elif after % self._sizes[other] == region:
                    return False
        # State changes only from here on: most poses have been refused before.
        if entered is None:
            self._entered[region] = [robot]
        else:
            entered.append(robot)
        following[robot] = pose
        self._trail.append(robot)
        if pushed:
            behind = waiting | {robot}
            for other in pushed:
                if other not in following and not self._place(other, behind):
                    return False
                if following[other] % self._sizes[other] == region:
                    return False
        return True

    def _kept_out(self, robot: int, region: int) -> bool:
        """Return whether a robot must not enter a region because of the region where another robot
        is, will be or may be."""
        if region == self._regions[robot]:
            return False
        for others, zone in self._claimed:
            if robot in others and zone >> region & ~(zone >> self._regions[robot]) & 1:
                return True
        for robots, zone in self._zones:
            if robot not in robots or not zone >> region & 1:
                continue
            for other in robots:
                here, after = self._regions[other], self._next.get(other)
                there = here if after is None else after % self._sizes[other]
                if other != robot and (zone >> here | zone >> there) & 1:
                    return True
        return False

    def _candidates(self, robot: int) -> list[int]:
        """Return the poses that a robot may take, the nearest to its goal poses first."""
        known = self._ranked.get(robot)
        if known is None:
            known = self._ranked[robot] = self._rank(robot)
        ranks, settled = known
        if settled is not None:
            return settled
        random = self._rng.random
        return [r[3] for r in sorted([(far, stands, random(), q) for far, stands, q in ranks])]

    def _rank(self, robot: int) -> tuple[list[Rank], list[int] | None]:
        """Return the rank of each pose, and the order of the poses if there are no ties."""
        field, conflicts, size = self._fields[robot], self._conflicts[robot], self._sizes[robot]
        if robot in self._evicted:
            graph, allowed = self._course.problem.members[robot].graph, self._steps[robot].allowed
            outside = allowed & ~graph.poses_on(self._evicted[robot])
            field = graph.distances(outside, allowed)
        here = self._poses[robot]
        ranks: list[Rank] = [(0 if field is None else field[here], False, here)]
        for pose in self._steps[robot][here]:
            there = self._now.get(pose % size)
            standing = there is not None and not conflicts.isdisjoint(there)
            ranks.append((1 if field is None else field[pose], standing, pose))
        ranks.sort()
        tied = any(one[:2] == two[:2] for one, two in pairwise(ranks))
        return ranks, None if tied else [rank[2] for rank in ranks]
