"""The state of a running mission from which lower bounds are computed."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.runtime.coordination.snapshot import stage_of
from safenav.runtime.deadlines.bound import BoundMoment, BoundObstacle, BoundRobot
from safenav.runtime.resolution.problem import OpenObstacle
from safenav.runtime.team import RobotState, TeamState
from safenav.scenario.settings import switching
from safenav.world.poses import Mask, plain_graph


def moment_of(
    team: TeamState, had_turn: int, begun: Mapping[str, int]
) -> tuple[BoundMoment, list[str]]:
    """Return the state after the turns of the first ``had_turn`` robots in the present tick, and
    the names of its open obstacles. ``begun``: the ticks in which robots in transit began their
    steps.

    Obstacles that will disappear and formulas are ignored, and robots out of service count as in
    service: this only lowers the bounds.
    """
    walkers = tuple(
        _walker(team, robot, team.tick if index < had_turn else team.tick - 1, begun)
        for index, robot in enumerate(team.robots.values())
    )
    robots = [robot.robot for robot in team.robots.values()]
    opens = tuple(
        BoundObstacle(OpenObstacle.of(each, robots, team.scenario.map), stage_of(team, each))
        for each in (request.obstacle for request in team.requests)
        if each.goes is None
    )
    now = team.tick * len(robots) + had_turn - 1
    return BoundMoment(walkers, opens, now), [one.gate.name for one in opens]


def objectives_change(team: TeamState) -> bool:
    """Whether the scenario still gives a robot another objective, which changes the bound of the
    mission."""
    scenario, tick = team.scenario, team.tick
    if any(change.objective is not None and change.at > tick for change in scenario.changes):
        return True
    listed = any(at > tick for at in switching(scenario.inputs))
    return listed and any(robot.when for robot in scenario.robots)


def goals_left(team: TeamState, robot: RobotState, rounds: int | None = None) -> list[Mask] | None:
    """The targets that a robot must still meet in sequence for its round, or for all of ``rounds``;
    None if it chooses their order."""
    objective = robot.own.objective
    if not objective.ordered():
        return None
    graph = plain_graph(team.scenario.map, robot.robot.model.mobility)
    masks = graph.on_each(objective.targets)
    first = robot.own.memory.index if objective.in_turn else 0
    if objective.settles:
        return [*masks[first:]] if robot.own.rounds < 1 else []
    left = len(masks) - len(robot.own.seen)
    if rounds is not None:
        left += (rounds - robot.own.rounds - 1) * len(masks)
    return [masks[(first + k) % len(masks)] for k in range(max(left, 0))]


def goals_from_start(team: TeamState, robot: RobotState) -> list[list[Mask]]:
    """The targets that a robot must meet in sequence for all rounds, from the start of its
    objective; several lists if it may begin with any target (``literal``: with the first, or with
    the one on which it stands); none if it chooses the order. A target on which it stands counts as
    met."""
    objective, rounds = robot.own.objective, team.scenario.until.rounds
    if not objective.ordered():
        return []
    graph = plain_graph(team.scenario.map, robot.robot.model.mobility)
    masks = graph.on_each(objective.targets)
    pose, count = 1 << graph.number(robot.pose), len(masks)
    if objective.settles:
        orders = [[*masks, *masks[-1:] * (rounds - 1)]]
    else:
        firsts = [0]
        if objective.strict:
            free = not objective.literal
            firsts += [k for k in range(1, count) if free or masks[k] & pose]
        orders = [[*masks[first:], *masks[:first]] * rounds for first in firsts]
    return [order[bool(order[0] & pose) :] for order in orders]


def _walker(team: TeamState, robot: RobotState, ready: int, begun: Mapping[str, int]) -> BoundRobot:
    model = robot.robot.model
    graph = plain_graph(team.scenario.map, model.mobility)
    leaves, until = None, 0
    if robot.transit is not None:
        leaves = graph.number(robot.pose)
        since = begun.get(robot.name, team.tick)
        ready = until = max(ready + 1, since + model.timing - 1)
    walls = graph.on(
        known.obstacle.region
        for known in team.knowledge.permanent.values()
        if known.obstacle.goes is None and known.obstacle.blocks(robot.robot)
    )
    number, skills = graph.number(robot.next_pose), robot.robot.capabilities
    return BoundRobot(graph, number, ready, model.timing, skills, walls, leaves, until)
