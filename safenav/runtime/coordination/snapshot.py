"""The coordination problem of a running mission: robots, obstacles, stages."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import lru_cache
from math import inf

from msgspec.structs import replace

from safenav.bounds import Place
from safenav.runtime.duties.requests import OpenRequest
from safenav.runtime.formulas import formulas_of, graph_of
from safenav.runtime.progress import Progress
from safenav.runtime.resolution.problem import Floor, Member, OpenObstacle, Problem, Stage
from safenav.runtime.team import RobotState, TeamState
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reachability import is_cut_off
from safenav.world.poses import Mask, PoseGraph, bits, region_mask


def floor_of(
    state: TeamState, refused: Collection[tuple[str, str]] = (), *, hopeful: bool = False
) -> Floor:
    """Return the problem at this moment. ``refused``: (robot, obstacle) where no strategy was
    found. ``hopeful``: as if every robot were in service."""
    scenario = state.scenario
    robots = [entry.robot for entry in state.robots.values()]
    names = tuple(state.robots)
    gates, stages = [], []
    requests = [*state.requests][::-1]
    requests.sort(key=lambda request: _due(state, request))
    for request in requests:
        obstacle = state.knowledge.pending[request.obstacle.name].obstacle
        none = {*state.failures.barred}
        if state.live and not hopeful:  # robots out of service do nothing
            none |= {(name, obstacle.name) for name, e in state.robots.items() if not e.active}
        out = (
            frozenset(i for i, name in enumerate(names) if (name, obstacle.name) in pairs)
            for pairs in (none, refused)
        )
        gate = OpenObstacle.of(obstacle, robots, scenario.map, *out)
        fail = (name for name, failed in state.failures.barred if failed == obstacle.name)
        stopped = frozenset(i for i in map(names.index, fail) if obstacle.blocks(robots[i]))
        strays = (cut_off(state, obstacle, need) for need in range(len(obstacle.needs)))
        restarts = scenario.restarts_rounds(obstacle.name)
        gates.append(
            replace(
                gate,
                closed_to=tuple(group | stopped for group in gate.closed_to),
                restarts=restarts,
                cut_off=tuple(frozenset(map(names.index, group)) for group in strays),
            )
        )
        stages.append(stage_of(state, obstacle))
    members = tuple(
        _member(robot, state) if hopeful or entry.active else _out_of_service(entry, state)
        for robot, entry in zip(robots, state.robots.values(), strict=True)
    )
    zones = tuple(
        (frozenset(map(names.index, each.robots)), region_mask(each.regions))
        for each in scenario.never_together
    )
    problem = Problem(members, tuple(gates), _conflicts(scenario), zones)
    poses = tuple(
        member.graph.number(entry.next_pose)
        for member, entry in zip(members, state.robots.values(), strict=True)
    )
    return Floor(
        problem,
        tuple(stages),
        poses,
        names,
        tuple(request.obstacle.name for request in requests),
        tuple(state.knowledge.given_up()),
    )


def _due(state: TeamState, request: OpenRequest) -> float:
    """Return the tick in which a request is due; infinite without a deadline."""
    due = state.dues(request)
    return inf if due is None else due


def moved_on(floor: Floor, state: TeamState) -> Floor:
    """Return a problem as it was settled, with every robot at its present pose."""
    robots = zip(floor.problem.members, state.robots.values(), strict=True)
    poses = tuple(member.graph.number(robot.next_pose) for member, robot in robots)
    return replace(floor, poses=poses)


def stage_of(state: TeamState, obstacle: Obstacle) -> Stage:
    """Return the stage of an open obstacle."""
    work, number = state.knowledge.pending[obstacle.name], state.knowledge.need_of(obstacle)
    index = [*state.robots].index
    same = obstacle.needs[number].same
    group = frozenset(map(index, work.groups[number - 1])) if same else None
    return Stage(number, frozenset(map(index, work.done)), group)


def serving(team: TeamState, floor: Floor) -> dict[int, tuple[int, ...]]:
    """Return the robots that already serve each obstacle, by number."""
    found: dict[int, tuple[int, ...]] = {}
    for index, robot in enumerate(team.robots.values()):
        obstacle = robot.assignment.obstacle
        if obstacle in floor.gates:
            gate = floor.gates.index(obstacle)
            found[gate] = (*found.get(gate, ()), index)
    return found


def awaited_by(floor: Floor, robot: str, progress: Progress) -> Mask:
    """Return the poses one of which a robot must reach next for its own objective."""
    member = floor.problem.members[floor.index(robot)]
    if not member.targets:
        return 0
    return member.awaited(progress.memory.index if member.in_turn else region_mask(progress.seen))


def _member(robot: Robot, state: TeamState) -> Member:
    scenario = state.scenario
    graph, formulas = graph_of(robot, scenario.map), formulas_of(robot, scenario.map)
    closed = {known.region for known in state.knowledge.walls_for(robot)}
    floor, here = graph.outside(closed), state.robots[robot.name].next_pose
    if here.region in closed:  # it stands there, and may stay
        graph = graph.left_only(graph.number(here))
        came = state.robots[robot.name].came
        inside = came is not None and state.robots[robot.name].transit is None
        if came is not None and inside and state.knowledge.around(here.region, robot) is not None:
            graph = graph.back_only(graph.number(here), came.region)
        floor |= 1 << graph.number(here)
    targets = graph.on_each(robot.objective.targets) if formulas is None else formulas.goals
    return Member(
        robot.name,
        graph,
        floor,
        targets,
        robot.objective.in_turn,
        robot.objective.settles,
        robot.capabilities,
        robot.model.timing,
        state.knowledge.is_laden(robot.name),
        robot.objective.strict and not robot.objective.literal,  # see ``spec.forms``
    )


def _out_of_service(robot: RobotState, state: TeamState) -> Member:
    """Return a robot out of service: it can only perform actions from where it stands, and has no
    other objective."""
    member = _member(robot.robot, state)
    here = 1 << member.graph.number(robot.next_pose)
    alone = replace(member, floor=here, targets=(here,), in_turn=False, settles=True)
    return replace(alone, any_first=False)


@lru_cache(maxsize=64)
def _conflicts(scenario: Scenario) -> tuple[frozenset[int], ...]:
    return tuple(
        frozenset(map(scenario.robots.index, scenario.in_conflict(robot)))
        for robot in scenario.robots
    )


def poses_in(graph: PoseGraph, poses: Mask) -> tuple[Place, ...]:
    """Return poses in the form of a proof: region and heading, ascending."""
    found = (graph.pose(number).place for number in bits(poses))
    return tuple(sorted(found, key=lambda e: (e[0], e[1] or "")))


def cut_off(team: TeamState, obstacle: Obstacle, need: int) -> frozenset[str]:
    """Return the robots that do not take a load by a need. An action that has begun is ended even
    if its robot has got another objective."""
    world, robots = team.scenario.map, team.robots
    out = (
        s for s in robots.values() if s.acting is None or obstacle not in robots[s.acting].acts_on
    )
    at = ((state.robot, state.next_pose.region) for state in out)
    return frozenset(r.name for r, here in at if is_cut_off(r, here, obstacle, need, world))


def takers(team: TeamState, loads: Iterable[Obstacle]) -> dict[str, frozenset[str]]:
    """Return the only robots that take each load next, if some cannot."""
    found = {load.name: cut_off(team, load, team.knowledge.need_of(load)) for load in loads}
    return {name: frozenset(team.robots) - out for name, out in found.items() if out}
