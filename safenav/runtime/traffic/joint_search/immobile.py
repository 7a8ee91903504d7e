"""Robots that can never move again, which shows that a joint state is hopeless long before a search
ends.

Two robots with headings that face each other in a corner stay there forever: each can step only
into the other's region. In general these are the greatest set of robots whose steps all lead into a
region of another one of the set, or to a pose from which the robot could not continue forever.
Moves of other robots and disappearing obstacles cannot change that. On full floors most paths end
like this.
"""

from __future__ import annotations

from safenav.runtime.traffic.joint_search.states import Course, JointState, Steps


class ImmobileRobots:
    """Finds immobile robots in the joint states of a course."""

    def __init__(self, course: Course) -> None:
        self._course = course
        self._members = course.problem.members
        self._conflicts = course.problem.conflicts
        self._sizes = [member.graph.size for member in self._members]
        self._after = [_Regions(m.graph, m.live(m.floor)) for m in self._members]
        self._rivals = [i for i, conflicts in enumerate(self._conflicts) if conflicts]
        self._possible = any(
            self._members[i].turns or self._members[i].floor.bit_count() == 1 for i in self._rivals
        )

    def robots(self, poses: tuple[int, ...]) -> set[int]:
        """Return the robots that can never move again."""
        if not self._possible:
            return set()
        after, sizes = self._after, self._sizes
        taken = {poses[robot] % sizes[robot] for robot in self._rivals}
        found = {robot for robot in self._rivals if taken.issuperset(after[robot][poses[robot]])}
        while found:
            free = [robot for robot in found if self._may_leave(robot, poses, found)]
            if not free:
                break
            found.difference_update(free)
        return found

    def cannot_complete(self, state: JointState) -> set[int]:
        """Return robots of which one can never complete, with any behaviour of the others; empty if
        none are known."""
        stuck = self.robots(state.poses)
        if not stuck:
            return stuck
        course = self._course
        for robot, count in enumerate(state.counts):
            stands = course.stands(robot, state.poses[robot])
            if robot in course.excused or (stands and course.is_done(robot, count)):
                continue
            if robot in stuck or not self._gets_on(robot, state, stuck):
                return stuck | {robot}
        return set()

    def _may_leave(self, robot: int, poses: tuple[int, ...], stuck: set[int]) -> bool:
        """Return whether some step leads to a region without a robot that is assumed to be
        immobile."""
        others = self._conflicts[robot] & stuck
        taken = {poses[other] % self._sizes[other] for other in others}
        return not taken.issuperset(self._after[robot][poses[robot]])

    def _gets_on(self, robot: int, state: JointState, stuck: set[int]) -> bool:
        """Return whether a robot can reach its next targets past the immobile robots."""
        walls = 0
        for other in self._conflicts[robot] & stuck:
            walls |= 1 << state.poses[other] % self._sizes[other]
        member = self._members[robot]
        allowed = member.floor & ~member.graph.poses_on(walls)
        goal = self._course.awaited(robot, state.counts[robot]) & allowed
        return bool(member.graph.back(goal, allowed) >> state.poses[robot] & 1)


class _Regions(Steps):
    """The regions of the ``allowed`` poses one step away from each pose; computed on demand."""

    def __missing__(self, pose: int) -> tuple[int, ...]:
        self[pose] = tuple(step % self.graph.size for step in super().__missing__(pose))
        return self[pose]
