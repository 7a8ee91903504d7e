"""Robots that have made way for a helper follow it, as near to what they wait for as they can.

A plan ends when an obstacle is resolved. By then a robot that waits for that, and has done its way
on the plan, may stand behind the helper instead of where it let it pass.
"""

from __future__ import annotations

from collections.abc import Sequence

from safenav.runtime.traffic.execution import schedule
from safenav.runtime.traffic.joint import Course, Joint
from safenav.runtime.traffic.shortening import TimedPath, arrival_of, closed_by, timed
from safenav.world.poses import FAR, bits


def following(course: Course, states: Sequence[Joint], robot: int) -> list[Joint] | None:
    """Return a plan of the same ticks in which a robot, once it has done its way, comes as near as
    possible to its next target; None if it comes no nearer, or the plan would be another."""
    problem, first, last = course.problem, states[0], states[-1]
    sizes = [member.graph.size for member in problem.members]
    graph = problem.members[robot].graph
    joint = timed(schedule([s.poses for s in states], sizes, problem.conflicts))
    goal = course.awaited(robot, last.counts[robot])
    far = graph.distances(goal, problem.allowed(robot, last.stages))
    begin = arrival_of(joint, robot)
    here, allowed = joint[begin][robot], course.steps(first.stages)[robot].allowed
    closed = closed_by(joint[begin:], problem.conflicts[robot], sizes, graph)
    reached = 1 << here
    for shut in closed:
        free = reached & ~shut
        reached = free | graph.forward(free) & allowed & ~shut
    pose = min(bits(reached), key=far.__getitem__, default=here)
    if not far[pose] < min(far[here], FAR):
        return None
    path = TimedPath(graph, allowed, (), 1 << pose)
    way = path.way(here, closed, [0] * len(closed) + [1 << pose], len(closed), early=False)
    if way is None:
        return None
    found = [first]
    for tick, poses in enumerate(joint[1:], 1):
        step = poses[robot] if tick <= begin else way[tick - begin]
        new = (*poses[:robot], step, *poses[robot + 1 :])
        found.append(course.moved(found[-1], new, range(len(new))))
    same = all(state.stages == first.stages for state in found[:-1])
    return found if same and found[-1].stages == last.stages else None
