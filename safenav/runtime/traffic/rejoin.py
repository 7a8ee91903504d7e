"""Return to a plan that was found before: robots that have left its paths rejoin them one by one.

A plan for the whole mission stays a certificate while every robot makes only reversible moves: a
robot that has left it comes back, and all follow the rest. That takes a few searches for one robot
each, not one for all. Goals met meanwhile need not be met again, so the rest achieves no less than
it did; still, all of it is walked through before it is trusted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

from safenav.runtime.traffic.budgets import REJOIN_PLACES
from safenav.runtime.traffic.joint import Course, Joint
from safenav.world.poses import bits


def rejoined(course: Course, start: Joint, plan: Sequence[Joint]) -> tuple[Joint, ...] | None:
    """The joint states from ``start`` to the end of the mission along ``plan``, a plan for the same
    problem; None if this way finds none."""

    def apart(at: int) -> tuple[int, int]:
        pairs = zip(plan[at].poses, start.poses, strict=True)
        return sum(pose != now for pose, now in pairs), -at

    for at in sorted(range(len(plan)), key=apart)[:REJOIN_PLACES]:
        if plan[at].stages != start.stages:
            continue
        states = _return(course, start, plan[at].poses)
        if states is not None and _follow(course, states, plan[at:]):
            return tuple(states)
    return None


def _return(course: Course, start: Joint, poses: tuple[int, ...]) -> list[Joint] | None:
    """The states on the way to joint poses, one robot moving after the other."""
    states = [start]
    while states[-1].poses != poses:
        before = len(states)
        for robot, pose in enumerate(poses):
            for step in _way(course, states[-1], robot, pose):
                states.append(course.after(states[-1], robot, step))
                if states[-1].stages != start.stages:
                    return None
        if len(states) == before:
            return None
    return states


def _way(course: Course, state: Joint, robot: int, goal: int) -> list[int]:
    """Return a shortest path of one robot while the others stand still; empty if there is none."""
    start = state.poses[robot]
    if start == goal:
        return []
    size = course.problem.members[robot].graph.size
    taken = {state.poses[other] % size for other in course.problem.conflicts[robot]}
    regions = [p % m.graph.size for p, m in zip(state.poses, course.problem.members, strict=True)]
    taken |= {*bits(course.problem.held(robot, regions, state.stages))}
    steps = course.steps(state.stages)[robot]
    before = {start: start}
    queue = deque([start])
    while queue:
        pose = queue.popleft()
        for after in steps[pose]:
            if after in before or after % size in taken:
                continue
            before[after] = pose
            if after == goal:
                way = [goal]
                while before[way[-1]] != start:
                    way.append(before[way[-1]])
                return way[::-1]
            queue.append(after)
    return []


def _follow(course: Course, states: list[Joint], plan: Sequence[Joint]) -> bool:
    """Continue along a plan from its first state; return whether that completes the mission."""
    for here, there in pairwise(plan):
        state = states[-1]
        if course.completed(state):
            return True
        if state.stages != here.stages:
            return False
        states.append(course.moved(state, there.poses, range(len(there.poses))))
    return course.completed(states[-1])
