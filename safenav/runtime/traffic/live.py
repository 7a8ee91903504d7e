"""Plans of robots that move in time, as pure functions: who waits for whom, where a plan begins."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from safenav.runtime.coordination.problem import Problem
from safenav.runtime.traffic.execution import Execution
from safenav.runtime.traffic.joint import Count, Joint
from safenav.world.poses import Mask


def still(waits: Mapping[str, Collection[str]], busy: Collection[str]) -> set[str]:
    """The robots that only wait for robots that wait: those from which no chain leads to a robot
    that is ``busy``. ``waits``: the robots in conflict beside each one."""
    moving = set(busy)
    while True:
        more = {n for n, others in waits.items() if n not in moving and moving & set(others)}
        if not more:
            return set(waits) - moving
        moving |= more


def still_needed(problem: Problem, plan: Execution, robot: int) -> Mask:
    """The regions that the others need for the rest of a plan: closed to a robot that has done its
    way of it. One that enters none of them, and can come back without entering them, leaves the
    rest of the plan as it was (docs/coordination.md, A live run)."""
    found, size = 0, problem.members[robot].graph.size
    for other in problem.conflicts[robot]:
        found |= plan.ahead(other, size)
    for group, zone in problem.apart:
        if robot in group and any(zone & plan.ahead(other, size) for other in group - {robot}):
            found |= zone
    return found


def with_steps_under_way(
    poses: Sequence[tuple[int, ...]],
    states: Sequence[Joint],
    counts: Sequence[Count],
    under_way: Mapping[int, int],
) -> tuple[list[tuple[int, ...]], list[Joint]]:
    """The joint poses and states of a plan which begins while robots are on their way: the way of
    such a robot begins where it set out (``under_way``), and its first step is that one."""
    if not under_way:
        return list(poses), list(states)

    def before(joint: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(under_way.get(robot, pose) for robot, pose in enumerate(joint))

    first = replace(states[0], poses=before(states[0].poses), counts=tuple(counts))
    return [before(poses[0]), *poses], [first, *states]
