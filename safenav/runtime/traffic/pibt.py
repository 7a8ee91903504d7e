"""PIBT: one simultaneous step for a whole team, robots pushing those that stand in their way.

Priority inheritance with backtracking (Okumura, Machida, Defago, Tamura: Priority inheritance with
backtracking for iterative multi-agent path finding, Artificial Intelligence 310, 2022), over poses
instead of places. Each robot takes the free pose nearest to its goal poses; one that stands there
takes its own step first, and if it cannot, the next best pose is tried. Robots move one after the
other within a tick, so a region may be entered that is left in the same step, but full cycles turn
nowhere: no robot moves into the region of one that waits for it to move.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from itertools import pairwise

from safenav.runtime.traffic.joint import Course, Joint

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
        self._zones = course.problem.apart
        self._state: Joint | None = None
        self._fields: Sequence[Field] = ()

    def propose(
        self,
        state: Joint,
        fields: Sequence[Field],
        order: Sequence[int],
        forced: tuple[int, int] | None = None,
    ) -> tuple[int, ...] | None:
        """The poses after one joint step, robots choosing in ``order``; ``forced`` is a robot
        and the pose that it must take. None if that cannot be. ``fields`` must not be changed
        between proposals for a state."""
        if state is not self._state or fields is not self._fields:
            self._look(state, fields)
        self._next: dict[int, int] = {}
        self._entered: dict[int, list[int]] = {}
        self._trail: list[int] = []
        if forced is not None and not self._place(forced[0], frozenset(), (forced[1],)):
            return None
        for robot in order:
            if robot not in self._next and not self._place(robot, frozenset()):
                return None
        return tuple([self._next[robot] for robot in range(len(state.poses))])

    def _look(self, state: Joint, fields: Sequence[Field]) -> None:
        """Prepare the data that all proposals for a state share."""
        self._state, self._fields = state, fields
        self._poses = state.poses
        self._regions = [p % size for p, size in zip(state.poses, self._sizes, strict=True)]
        self._now: dict[int, list[int]] = {}
        for robot, region in enumerate(self._regions):
            self._now.setdefault(region, []).append(robot)
        self._steps = self._course.hopeful(state.stages)
        self._ranked: dict[int, tuple[list[Rank], list[int] | None]] = {}

    def _place(
        self, robot: int, waiting: frozenset[int], only: Sequence[int] | None = None
    ) -> bool:
        """Give a robot its next pose; ``waiting``: those that push it, directly or not."""
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
        # Nothing was changed so far: most poses are refused by then.
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
        """Whether a robot that this one is never together with is there, or will be."""
        for group, zone in self._zones:
            for other in group if robot in group and zone >> region & 1 else ():
                after = self._next.get(other, 0) % self._sizes[other]
                there = zone >> self._regions[other] & 1 or (
                    other in self._next and zone >> after & 1
                )
                if other != robot and there:
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
        return [r[3] for r in sorted([(wish, stands, random(), q) for wish, stands, q in ranks])]

    def _rank(self, robot: int) -> tuple[list[Rank], list[int] | None]:
        """Return the rank of each pose, and the order of the poses if there are no ties."""
        field, conflicts, size = self._fields[robot], self._conflicts[robot], self._sizes[robot]
        here = self._poses[robot]
        ranks: list[Rank] = [(0 if field is None else field[here], False, here)]
        for pose in self._steps[robot][here]:
            there = self._now.get(pose % size)
            standing = there is not None and not conflicts.isdisjoint(there)
            ranks.append((1 if field is None else field[pose], standing, pose))
        ranks.sort()
        tied = any(one[:2] == two[:2] for one, two in pairwise(ranks))
        return ranks, None if tied else [rank[2] for rank in ranks]
