"""PIBT: one step for a whole team at once, robots pushing those that stand in their way.

Priority inheritance with backtracking (Okumura, Machida, Defago, Tamura: Priority inheritance with
backtracking for iterative multi-agent path finding, Artificial Intelligence 310, 2022), over poses
instead of places. Each robot takes the free pose nearest to its wish; one that stands there takes
its own step first, and if it cannot, the next best pose is tried. Robots move one after the other
within a tick, so a region may be entered that is left in the same step, but full cycles turn
nowhere: nobody moves into the region of one that waits for it to move.
"""

from __future__ import annotations

import random
from collections.abc import Sequence

from safenav.runtime.traffic.joint import Course, Joint

Field = list[int] | None
"""The distance of each pose to a robot's wish; None without one."""


class Generator:
    """Proposes joint steps. ``rng`` breaks ties."""

    def __init__(self, course: Course, rng: random.Random) -> None:
        self._course = course
        self._rng = rng
        self._sizes = [member.graph.size for member in course.problem.members]
        self._conflicts = course.problem.conflicts

    def propose(
        self,
        state: Joint,
        fields: Sequence[Field],
        order: Sequence[int],
        forced: tuple[int, int] | None = None,
    ) -> tuple[int, ...] | None:
        """The poses after one joint step, robots choosing in ``order``; ``forced`` is a robot
        and the pose that it must take. None if that cannot be."""
        self._state = state
        self._fields = fields
        self._now: dict[int, list[int]] = {}
        for robot, pose in enumerate(state.poses):
            self._now.setdefault(pose % self._sizes[robot], []).append(robot)
        self._next: dict[int, int] = {}
        self._entered: dict[int, list[int]] = {}
        self._trail: list[int] = []
        if forced is not None and not self._place(forced[0], set(), (forced[1],)):
            return None
        for robot in order:
            if robot not in self._next and not self._place(robot, set()):
                return None
        return tuple(self._next[robot] for robot in range(len(state.poses)))

    def _place(self, robot: int, waiting: set[int], only: tuple[int, ...] | None = None) -> bool:
        """Give a robot its next pose; ``waiting``: those that push it, directly or not."""
        for pose in only or self._candidates(robot):
            mark = len(self._trail)
            if self._take(robot, pose, waiting):
                return True
            while len(self._trail) > mark:
                undone = self._trail.pop()
                self._entered[self._next.pop(undone) % self._sizes[undone]].remove(undone)
        return False

    def _take(self, robot: int, pose: int, waiting: set[int]) -> bool:
        region = pose % self._sizes[robot]
        conflicts = self._conflicts[robot]
        for other in self._entered.get(region, ()):
            if other in conflicts:
                return False
        self._next[robot] = pose
        self._entered.setdefault(region, []).append(robot)
        self._trail.append(robot)
        if region == self._state.poses[robot] % self._sizes[robot]:
            return True
        pushed = []
        for other in self._now.get(region, ()):
            if other == robot or other not in conflicts:
                continue
            if other in waiting:
                return False
            if other not in self._next:
                pushed.append(other)
            elif self._next[other] % self._sizes[other] == region:
                return False
        if pushed:
            behind = waiting | {robot}
            for other in pushed:
                if other not in self._next and not self._place(other, behind):
                    return False
                if self._next[other] % self._sizes[other] == region:
                    return False
        return True

    def _candidates(self, robot: int) -> list[int]:
        state, field = self._state, self._fields[robot]
        here = state.poses[robot]
        poses = [here, *self._course.hopeful(state, robot)]
        if len(poses) == 1:
            return poses
        size, conflicts, rng = self._sizes[robot], self._conflicts[robot], self._rng

        def rank(pose: int) -> tuple[int, int, float]:
            standing = pose != here and any(
                other in conflicts for other in self._now.get(pose % size, ())
            )
            wish = (pose != here) if field is None else field[pose]
            return wish, standing, rng.random()

        return sorted(poses, key=rank)
