"""Goals assigned at run time: a robot with a strategy keeps it, and its inputs command it to wait,
or to go to a region (the paper's alternative to resynthesis).

It is led around known obstacles, which its strategy does not contain. The current command follows
from the strategy's node, so no other state is kept.
"""

from __future__ import annotations

from collections.abc import Iterator

from safenav.plan.order import closed
from safenav.runtime.control.observing import heard
from safenav.runtime.control.roles import Role
from safenav.runtime.control.tasks import Controller
from safenav.spec.assignable import neutral
from safenav.spec.assignable_regions import assignable_regions
from safenav.team.formulas import targets_of
from safenav.team.state import State
from safenav.team.team import Team
from safenav.world.poses import FAR, Mask

MOST_STEPS = 40
"""Number of steps of a strategy that are followed to see whether they lead to a goal: it may first
meet one that it pursued before."""
Step = tuple[int, int | None, int]
"""A region, a heading, and the strategy's node there."""


def commanded(
    team: Team, state: State, i: int, role: Role, found: Controller, safe: Mask | None
) -> list[Step]:
    """The steps of a strategy under the first command that leads its robot toward its goal; else it
    waits. ``safe``: the poses in which the team can continue."""
    robot, member, task = state.robots[i], team.members[i], found.task
    assert robot.node is not None and found.result.strategy is not None
    before, graph = found.result.strategy.values(robot.node), member.graph
    possible = assignable_regions(task, team.world)
    idle, own = neutral(possible), role.objective == member.objective
    others, shut = heard(team, state, i, task), closed(team, state, i)

    def steps(node: int, place: int | None, *, wait: bool = False) -> list[Step]:
        signal = {"request": place is not None, "wait": wait, "assigned": idle}
        signal |= {} if place is None else {"assigned": place}
        return found.steps(node, others | {name: int(value) for name, value in signal.items()})

    def number(step: Step) -> int:
        return step[0] if step[1] is None else step[1] * team.size + step[0]

    free = member.floor & ~graph.on(shut) & (-1 if safe is None else safe)
    goal = _goal(team, state, i, role) & (free | 1 << robot.pose)
    if own and (not shut or goal >> robot.pose & 1):
        return steps(robot.node, None)
    field = graph.distances(goal, free)

    def leads(step: Step, place: int | None) -> bool:
        """Whether the strategy comes nearer to the goal by this step and its next ones."""
        for _ in range(MOST_STEPS):
            if not free >> number(step) & 1:
                return False
            if field[number(step)] < field[robot.pose]:
                return True
            following = steps(step[2], place)
            if not following:
                return False
            step = following[0]
        return False

    if not 0 < field[robot.pose] < FAR:
        return steps(robot.node, None, wait=True)
    sent = before["assigned"] if before["request"] and not before["wait"] else None
    memory, pose = dict(robot.values), graph.pose(robot.pose)
    places: list[int | None] = [sent]
    if sent is None:
        regions = (*_ahead(team, i, robot.pose, field, free), *sorted(possible.places))
        places = [r for r in dict.fromkeys(regions) if possible.allows(pose, memory, r)]
        places = [None, *places] if own else [*places, None]
    strategy = found.result.strategy
    for node in dict.fromkeys((robot.node, *strategy.nodes_with(strategy.values(robot.node)))):
        for place in places:
            for step in steps(node, place):
                if leads(step, place):
                    return [step]
    return steps(robot.node, None, wait=True)


def _goal(team: Team, state: State, i: int, role: Role) -> Mask:
    """The poses that a robot must reach next."""
    member, robot = team.members[i], state.robots[i]
    own = role.objective == member.objective
    return member.awaited(robot.own.memory) if own else targets_of(role.objective, member.graph)[0]


def _ahead(team: Team, i: int, pose: int, field: list[int], free: Mask) -> Iterator[int]:
    """The regions on a shortest path, the farthest first to which no shorter one leads for a
    strategy that knows no obstacles."""
    graph, found, start = team.members[i].graph, list[int](), pose
    while 0 < field[pose] < FAR:
        left = field[pose]
        pose = next(q for q in graph.steps(pose) if free >> q & 1 and field[q] < left)
        there = graph.poses_on(1 << pose % team.size)
        steps = graph.steps_between(1 << start, there, team.members[i].floor)
        if steps == field[start] - field[pose]:
            found.append(pose % team.size)
    yield from reversed(found)
