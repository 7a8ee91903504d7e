"""Robots that continue while the team waits for an operator or a change of the scenario."""

from __future__ import annotations

from safenav.runtime.team import RobotState, Role, TeamState
from safenav.scenario.objective import Ltl


def may_continue(team: TeamState, robot: RobotState) -> bool:
    """Whether a robot moves while the team waits. It must be able to undo each of its moves alone,
    and have a strategy for its own objective (without waiting for help, and if the wait is not
    about it), for its objective for waiting, or for the path to its charger."""
    planner, waiting = robot.planner, team.waiting
    if planner.node is None or not robot.active or robot.held is not None:
        return False
    if isinstance(robot.robot.objective, Ltl):
        return False
    pursued = planner.task.objective.relaxed()
    if robot.assignment.role is Role.WAITS and has_other_objective(team, robot):
        return pursued == robot.assignment.objective.relaxed()
    if robot.assignment.role is Role.CHARGES:
        charges = pursued == robot.assignment.objective.relaxed()
        return charges and not team.graph(robot).one_way
    if robot.assignment.role is not Role.OWN or pursued != robot.own.objective.relaxed():
        return False
    if waiting is not None and robot.name in (waiting.unrealizable or {}):
        return False
    return not _waits_for_help(team, robot) and not team.graph(robot).one_way


def may_act(team: TeamState, robot: RobotState) -> bool:
    """Whether a robot acts while the team waits for an operator, who may be where it acts: not if
    it waits for help itself and moves only to charge."""
    charges = robot.assignment.role is Role.CHARGES and not has_other_objective(team, robot)
    return may_continue(team, robot) and not (charges and _waits_for_help(team, robot))


def has_other_objective(team: TeamState, robot: RobotState) -> bool:
    """Whether a robot pursues its objective for waiting while the team waits for a change of the
    scenario."""
    if team.waits_until is None or robot.robot.while_waiting is None:
        return False
    return robot.active and _waits_for_help(team, robot) and not team.graph(robot).one_way


def _waits_for_help(team: TeamState, robot: RobotState) -> bool:
    """Whether a robot has requested help with an obstacle that is not resolved."""
    requests = (*team.requests, *team.requests.given_up)
    return any(robot.name in request.requesters for request in requests)
