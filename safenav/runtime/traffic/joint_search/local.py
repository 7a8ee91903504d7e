"""A plan for one robot of a large team: a few others move, and all the rest stay as obstacles.

The last resort if all moves can be undone and no plan for all robots was found in time. The others
may make no progress by it.
"""

from __future__ import annotations

import heapq
from itertools import count as counting
from typing import TYPE_CHECKING

from safenav.components import path_to
from safenav.runtime.traffic.budgets import LOCAL_ROBOTS, LOCAL_STATES
from safenav.runtime.traffic.joint_search.states import Course, Found
from safenav.world.poses import FAR

if TYPE_CHECKING:
    from safenav.runtime.traffic.joint_search.search import Search


def local_plan(search: Search) -> Found | None:
    """Return a plan that brings one robot to its goal poses and moves as few others as possible."""
    start = search.start
    fields = search.fields(start)
    wanting = [i for i, f in enumerate(fields) if f is not None and f[start.poses[i]] > 0]
    for others in range(LOCAL_ROBOTS + 1):
        for robot in wanting:
            movable = {robot, *_nearest(search, robot, others)}
            found = _leg(search, robot, movable)
            if found is not None:
                return found
    return None


def _nearest(search: Search, robot: int, count: int) -> list[int]:
    members, poses = search.course.problem.members, search.start.poses
    position = members[robot].graph.world.position
    size = members[robot].graph.size
    row, col = position(poses[robot] % size)

    def away(other: int) -> int:
        r, c = position(poses[other] % size)
        return abs(r - row) + abs(c - col)

    rivals = search.course.problem.conflicts[robot]
    return sorted(rivals, key=lambda other: (away(other), other))[:count]


def _leg(search: Search, robot: int, movable: set[int]) -> Found | None:
    """Search by A* over the steps of a few robots for the goal of one."""
    start, course = search.start, search.course
    still = frozenset(range(len(start.poses))) - movable
    limited = Course(
        course.problem, course.rounds, still, course.served, course.sent, course.excused
    )
    field = search.fields(start)[robot]
    assert field is not None
    ticket = counting()
    cost = {start: 0}
    before = {start: start}
    heap = [(field[start.poses[robot]], next(ticket), start)]
    while heap and len(before) < LOCAL_STATES and not search.work.done:
        search.stopping()
        _, _, state = heapq.heappop(heap)
        if field[state.poses[robot]] == 0 or state.stages != start.stages:
            return Found(path_to(state, before))
        for mover, pose in limited.singles(state):
            after = limited.after(state, mover, pose)
            search.work.left -= len(state.poses)
            paid = cost[state] + 1
            ahead = field[after.poses[robot]]
            if ahead < FAR and paid < cost.get(after, FAR):
                cost[after] = paid
                before[after] = state
                heapq.heappush(heap, (paid + ahead, next(ticket), after))
    return None
