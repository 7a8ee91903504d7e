"""Assignable goals: strategies with a goal that is assigned at runtime, without resynthesis as long
as the known obstacles stay the same (the paper's alternative).

Coordination leads a robot to its goal region by region, around all known obstacles, which its
strategy does not know.
"""

from __future__ import annotations

from collections.abc import Mapping

from safenav.runtime.coordination.task_candidates import TaskDraft
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.scenario.objective import station
from safenav.spec.assignable import AssignedGoal, CommandInputs
from safenav.world.map import Region
from safenav.world.poses import FAR, Mask


def own_objective(robot: RobotState, draft: TaskDraft) -> TaskDraft:
    """A draft for a strategy with assignable goals: the robot's own objective, with any
    assignment."""
    return TaskDraft(draft.assignment, robot.robot.objective)


def signal(team: TeamState, robot: RobotState, observed: Mapping[str, int]) -> dict[str, int]:
    """The inputs of a robot's strategy: continue, wait, or go to the next region on its path.
    ``observed``: its other inputs."""
    switch = robot.planner.switch
    assert switch is not None
    here = robot.pose.region
    place: Region | None = None
    assignment = robot.assignment
    if assignment.role is Role.OWN:
        awaited = robot.own.awaited()
        led = _meets_something(team, robot) or switch.refused == robot.pose
        if not awaited or not led:
            return switch.inputs(None, here)
        place = _next(team, robot, switch, team.graph(robot).on(awaited))
        if place == here:
            return switch.inputs(None, here)
    if assignment.role is Role.HELPS:
        place = _next(team, robot, switch, assignment.goal)
    elif (stay := station(assignment.objective)) is not None:
        place = _next(team, robot, switch, team.graph(robot).on(stay))
    if place is None or place == here:
        return switch.inputs(AssignedGoal(here, wait=True), here)
    by_steps = _by_steps(team, robot, switch)
    if by_steps and (inputs := _led(robot, switch, observed, place)) is not None:
        return inputs
    return switch.inputs(AssignedGoal(place, wait=False), here)


def _led(
    robot: RobotState, switch: CommandInputs, observed: Mapping[str, int], place: Region
) -> dict[str, int] | None:
    """Return inputs with which a robot's strategy goes to the adjacent region ``place``; None if
    there are none. After a goal met in passing its next step is open, so it may step elsewhere
    first, and be refused there repeatedly. It then continues from another node with the same
    values, which pursues another goal first."""
    planner = robot.planner
    before = planner.node
    if before is None or not planner.strategy.values(before)["wait"]:
        return None  # a command in progress keeps its region
    places = [p for p in sorted(switch.assignable.places) if p != place]
    allowed = [p for p in places if switch.assignable.allows(robot.pose, robot.memory.values, p)]
    for node in (before, *planner.strategy.alike(before)):
        planner.node = node
        for sent in (place, None, *allowed):
            inputs = switch.after_waiting(sent)
            answer = planner.propose({**observed, **inputs})
            if answer is not None and answer.pose.region == place:
                switch.sent(sent)
                return inputs
    planner.node = before
    return None


def _meets_something(team: TeamState, robot: RobotState) -> bool:
    """Whether an open obstacle, unknown to its strategy, blocks the robot."""
    knowledge = team.knowledge
    return any(knowledge.closed_to(w.obstacle, robot.robot) for w in knowledge.pending.values())


def _by_steps(team: TeamState, robot: RobotState, switch: CommandInputs) -> bool:
    """Whether a robot is led step by step, since its own path was refused in this pose."""
    stopped = switch.stopped == robot.pose and _meets_something(team, robot)
    return stopped or switch.refused == robot.pose


def _next(team: TeamState, robot: RobotState, switch: CommandInputs, goal: Mask) -> Region | None:
    """Return the region to which a robot with goal poses ``goal`` is sent: the farthest region on
    a shortest path around all known obstacles to which no shorter path exists for a strategy that
    does not know them. A robot whose own path was refused is led step by step."""
    knowledge = team.knowledge
    graph = team.graph(robot)
    own = graph.outside(known.region for known in robot.planner.task.blocked)
    walls = knowledge.walls_for(robot.robot, knowledge.pending)
    allowed = own & ~graph.on(known.region for known in walls)
    if robot.assignment.safe_poses is not None:
        allowed &= robot.assignment.safe_poses
    here = graph.number(robot.pose)
    goal &= allowed | 1 << here
    field, by_steps = graph.distances(goal, allowed), _by_steps(team, robot, switch)
    found: Region | None = None
    pose, steps = here, 0
    while 0 < field[pose] < FAR:
        ahead = field[pose]
        pose = next(q for q in graph.steps(pose) if allowed >> q & 1 and field[q] < ahead)
        steps += 1
        region = pose % graph.size
        there = graph.poses_on(1 << region)
        if not switch.assignable.allows(robot.pose, robot.memory.values, region):
            continue
        if graph.steps_between(1 << here, there, own) == steps:
            found = region
        if by_steps:
            break
    return robot.pose.region if field[here] == 0 else found
