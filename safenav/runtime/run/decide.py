"""A robot's next move: the proposal of its plan or strategy (NP) and its safety (EC)."""

from typing import NamedTuple

from safenav.errors import SynthesizerError
from safenav.formula.parser import parse
from safenav.formula.syntax import predicate
from safenav.plan.order import next_step
from safenav.runtime.control.coordinate import Situation
from safenav.runtime.control.strategies import commanded, heard
from safenav.scenario.objective import formulas_in, ruled
from safenav.spec.guarantees import guarantees_of
from safenav.spec.specification import Section
from safenav.team.acts import is_reserved
from safenav.team.apply import done, on_own
from safenav.team.known import barred, turns_back
from safenav.team.state import Is, State, Values
from safenav.team.team import Team


class Proposal(NamedTuple):
    """A proposed move: its destination (the robot's own pose: a stay), the origin of the decision,
    and the strategy's node there, with the values of its formulas."""

    pose: int
    by: str
    node: int | None = None
    values: Values | None = None


def continues(run: Situation, i: int) -> bool:
    """Return whether a robot moves while the team waits for outside help: it can undo each of its
    steps, and it has an objective for a wait or needs no help on its path."""
    team, state = run.team, run.state
    robot, member = state.robots[i], team.members[i]
    if member.planned or member.graph.one_way or member.objective.formulas is not None:
        return False
    mine, pairs = run.control.controllers[i], zip(team.obstacles, state.obstacles, strict=True)
    around = {known.region for known in mine.task.blocked} if mine else set[int]()
    asks = any(i in dict(now.asked) for o, now in pairs if now.known and o.region not in around)
    asks = asks or (run.control.end is not None and member.name in run.control.end.stuck)
    meanwhile = member.robot.while_waiting
    return robot.active and (
        (robot.objective == member.objective and not asks)
        or (meanwhile is not None and robot.objective == ruled(meanwhile, member.objective))
    )


def propose(run: Situation, i: int) -> Proposal:
    """Return the move of the joint plan that drives a robot, or else of its strategy."""
    team, state = run.team, run.state
    stay = Proposal(state.robots[i].pose, "stay")
    if not state.robots[i].active or i in run.control.pending:
        return stay
    behind = way_back(run, i)
    if behind is not None:
        steps = team.members[i].graph.steps(stay.pose)
        back = next((pose for pose in steps if pose % team.size == behind), stay.pose)
        free = not is_reserved(team, state, i, behind)
        return Proposal(back, "backtrack") if free else stay
    if not team.members[i].planned:
        return stay if _counts_again(team, state, i) else successor(run, i) or stay
    if run.control.thinks:
        return stay  # the next plan begins where the robots are
    pose = next_step(team, state, i)
    if pose is None or not _is_kept(run, i, pose):
        return stay
    if is_reserved(team, state, i, pose % team.size):
        return stay
    return Proposal(pose, "plan")


def _counts_again(team: Team, state: State, i: int) -> bool:
    """Return whether a robot with a strategy counts a target by staying, and need not return to it
    in this round."""
    member, robot = team.members[i], state.robots[i]
    objective, own = member.objective, robot.own
    if objective.ordered() or formulas_in(objective) or member.robot.tracks or team.assignable(i):
        return False
    left = member.pursuit.awaited(own.memory) & member.kept(robot.pose)
    return bool(left) and on_own(team, state, i) and not done(team, state, i)


def _is_kept(run: Situation, i: int, pose: int) -> bool:
    """Return whether a step satisfies a robot's formulas with the present inputs. Plans do not
    foresee inputs."""
    team, state = run.team, run.state
    robot, graph = state.robots[i], team.members[i].graph
    formulas = team.members[i].objective.formulas
    if formulas is None or not formulas.inputs:
        return True
    after = dict(robot.values) | formulas.heard(state.inputs) | dict(graph.memory(pose))
    places = graph.pose(robot.pose), graph.pose(pose)
    return guarantees_of(formulas).allows_with(places[0], dict(robot.values), places[1], after)


def successor(run: Situation, i: int) -> Proposal | None:
    """Return the move to the strategy node's only successor for the present inputs; None if there
    is none, or the team could not continue there."""
    team, state = run.team, run.state
    controller, robot = run.control.controllers[i], state.robots[i]
    if controller is None or robot.node is None or not controller.realizable:
        return None
    graph, every = team.members[i].graph, run.control.found.safe
    safe = every[i] if every else None  # empty: the team can never continue
    if controller.task.assignable:
        step = commanded(team, state, i, run.control.roles[i], controller, safe)
    else:
        step = controller.step(robot.node, heard(team, state, i, controller.task), team.size)
    if step is None:
        return None
    pose, node = step
    if pose != robot.pose and pose not in graph.steps(robot.pose):
        here, there = (team.world.label(p % team.size) for p in (robot.pose, pose))
        raise SynthesizerError(
            f"the strategy of {team.members[i].name} leads from {here} to {there}, which is "
            "not a step on this map; the robot did not move"
        )
    if pose != robot.pose and safe is not None and graph.one_way and not safe >> pose & 1:
        return None
    return Proposal(pose, "strategy", node, controller.values(node))


def node_while_staying(run: Situation, i: int, step: Proposal) -> tuple[int | None, bool]:
    """Return the node of a robot that stays, and whether its strategy is astray. If the strategy
    tracks other robots and has not chosen the stay, the new node combines the last node's values
    with the present observation."""
    controller, node = run.control.controllers[i], run.state.robots[i].node
    strategy = None if controller is None else controller.result.strategy
    if step.node is not None or controller is None or strategy is None or node is None:
        return step.node, False
    if controller.task.assignable:  # astray if no command leads a used strategy to its duty
        return None, node != controller.node
    if not controller.task.observed:
        return None, False
    now = strategy.values(node) | heard(run.team, run.state, i, controller.task)
    found = next(iter(strategy.nodes_with(now)), None)
    return found, found is None


def broken(run: Situation, i: int) -> tuple[str, ...]:
    """Return the assumptions of a robot's strategy that an observation without a successor
    violates."""
    team, state = run.team, run.state
    controller, node = run.control.controllers[i], state.robots[i].node
    strategy = None if controller is None else controller.result.strategy
    if strategy is None or controller is None or node is None or team.members[i].planned:
        return ()
    found, before = heard(team, state, i, controller.task), strategy.values(node)
    if controller.task.assignable or strategy.successors_for(node, found):
        return ()
    rules = (
        str(each.origin)
        for each in strategy.specification.section(Section.ENV_TRANS)
        if not predicate(parse(each.formula))(before, {**before, **found})
    )
    return tuple(dict.fromkeys(rules))


def closing(run: Situation, i: int, pose: int) -> int | None:
    """Return the known obstacle that forbids a move to a pose: the robot would enter it, or leave
    it by another side than it entered; None if there is none."""
    team, state = run.team, run.state
    robot, failed = state.robots[i], barred(team, state)
    here, region = robot.pose % team.size, pose % team.size
    if region == here:
        return None
    for k, each in enumerate(state.obstacles):
        obstacle = team.obstacles[k]
        if i not in obstacle.blocks or obstacle.region not in (here, region):
            continue
        if obstacle.region == here:
            turns = each.known or turns_back(team, state, i, k)
            if turns and robot.behind not in (None, region):
                return k
        elif (each.known or each.state is Is.SEALED) and (
            (i, k) in failed or obstacle.closes(i, each)
        ):
            return k
    return None


def way_back(run: Situation, i: int) -> int | None:
    """Return the region into which a robot backs out of an obstacle that it cannot resolve; None if
    it need not."""
    team, state = run.team, run.state
    robot = state.robots[i]
    here = (k for k, one in enumerate(team.obstacles) if one.region == robot.pose % team.size)
    return robot.behind if any(turns_back(team, state, i, k) for k in here) else None
