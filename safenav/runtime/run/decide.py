"""A robot's next move: what its driver proposes (NP), whether it is safe (EC), and what it does
instead."""

from __future__ import annotations

from typing import NamedTuple

from safenav.plan.order import next_step
from safenav.runtime.control.assignable import commanded
from safenav.runtime.control.coordinate import Control
from safenav.runtime.control.observing import heard
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl
from safenav.team.floor import reserved
from safenav.team.state import Is, State, Values
from safenav.team.team import Team


class Proposal(NamedTuple):
    """A pose to go to (its own: it stays), what decides that, and the strategy's node there,
    with the values of its formulas. ``why``: why it stays beyond that."""

    pose: int
    by: str
    node: int | None = None
    values: Values | None = None
    why: str | None = None


def propose(team: Team, state: State, control: Control, i: int) -> Proposal:
    """The driver's move: that of the joint plan for a robot with rivals, else of its strategy."""
    stay = Proposal(state.robots[i].pose, "stay")
    if control.end is not None or not state.robots[i].active:
        return stay
    if i in control.pending:
        return stay._replace(why="synthesis")
    if not team.members[i].planned:
        return next(iter(_successors(team, state, control, i)), stay)
    pose = next_step(team, state, i)
    if pose is None or not _is_kept(team, state, i, pose):
        return stay
    if reserved(team, state, i) >> pose % team.size & 1:
        return stay
    return Proposal(pose, "plan")


def _is_kept(team: Team, state: State, i: int, pose: int) -> bool:
    """Whether the inputs of its formulas let a robot take a step now: plans do not foresee them."""
    robot, graph, objective = state.robots[i], team.members[i].graph, team.members[i].objective
    if not isinstance(objective, Ltl) or not objective.inputs:
        return True
    heard = {name: int(name in state.inputs) for name in objective.inputs}
    after = dict(robot.values) | heard | dict(graph.memory(pose))
    places = graph.pose(robot.pose), graph.pose(pose)
    return guarantees_of(objective).allows_with(places[0], dict(robot.values), places[1], after)


def _successors(team: Team, state: State, control: Control, i: int) -> list[Proposal]:
    controller, robot = control.controllers[i], state.robots[i]
    if controller is None or robot.node is None or not controller.realizable:
        return []
    if not control.found.safe:
        return []  # the team can never continue
    safe, graph, found = control.found.safe[i], team.members[i].graph, []
    if controller.task.assignable:
        steps = commanded(team, state, i, control.roles[i], controller, safe)
    else:
        steps = controller.steps(robot.node, heard(team, state, i, controller.task))
    for region, heading, node in steps:
        pose = region if heading is None else heading * team.size + region
        if pose == robot.pose or safe is None or not graph.one_way or safe >> pose & 1:
            found.append(Proposal(pose, "strategy", node, controller.values(node)))
    return found


def closing(team: Team, state: State, i: int, step: Proposal) -> int | None:
    """The known obstacle that a robot would enter by a move."""
    region = step.pose % team.size
    if region == state.robots[i].pose % team.size:
        return None
    for k, each in enumerate(state.obstacles):
        obstacle = team.obstacles[k]
        if obstacle.region == region:
            if each.state in (Is.OPEN, Is.SEEN) and i in obstacle.closed_to[each.stage.need]:
                return k
            if each.state is Is.SEALED and i in obstacle.blocks:
                return k
    return None


def others(team: Team, state: State, control: Control, i: int, refused: Proposal) -> list[Proposal]:
    """Other successors of the strategy's node, which leave the refused region aside."""
    if team.members[i].planned or team.members[i].ticks > 1:
        return []
    found = _successors(team, state, control, i)
    region = refused.pose % team.size
    return [step._replace(by="backtrack") for step in found if step.pose % team.size != region]
