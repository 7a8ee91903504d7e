"""Trace lines of moves, joint plans, requests, and syntheses with their specification data."""

from itertools import accumulate, pairwise

from safenav.runtime.control.coordinate import Control
from safenav.runtime.control.ends import Request
from safenav.runtime.control.roles import helpers_of
from safenav.runtime.control.strategies import Controller
from safenav.spec.assignable import assignable_regions
from safenav.spec.belief import models
from safenav.spec.compile import assumption_names
from safenav.team import state as now
from safenav.team.acts import driven
from safenav.team.state import Plan, State
from safenav.team.team import Team
from safenav.trace import records
from safenav.trace.vocabulary import MovedBy, MoveEnd
from safenav.trace.words import listed
from safenav.world.map import RegionMap


def move_line(
    team: Team, tick: int, before: State, event: now.Event, after: State
) -> records.Record | None:
    """Return the line of a turn in lockstep in which a robot moves, stays or is in transit; None
    for other events and for a departure whose step ends in this turn."""
    result = None
    match event:
        case now.Goes(i):
            robot = after.robots[i]
            pose, to, by = robot.pose, robot.to, robot.by if robot.by != "plan" else None
        case now.Departed(i, to, by, due=int()):
            pose = before.robots[i].pose
        case now.Stayed(i, by):
            pose, to = after.robots[i].pose, None
        case now.Arrived(i) | now.Elsewhere(i) | now.Failed(i) | now.Lost(i):
            pose, to, by = after.robots[i].pose, None, before.robots[i].by
            result = None if isinstance(event, now.Arrived) else MoveEnd.ELSEWHERE
        case _:
            return None
    name, graph, size = team.members[i].name, team.members[i].graph, team.size
    place = before.robots[i].pose % size, *graph.pose(pose).place
    goes = None if to is None else to % size, None if by is None else MovedBy(by)
    return records.Move(tick, name, *place, *goes, result)


def command_line(
    team: Team, tick: int, before: State, event: now.Event, after: State
) -> records.Record | None:
    """Return the line of a live move command, or of its end; None for other events, and for a step
    that changes only the memory of formulas."""
    regions, reason = None, None
    match event:
        case now.Departed(i, pose, by, node) if event.command:
            way = before.robots[i].pose % team.size, *team.members[i].graph.pose(pose).place
            node = node if by == "strategy" else None
            seconds = None if event.seconds is None else round(event.seconds, 3)
            who = tick, event.command, team.members[i].name
            return records.Depart(*who, *way, MovedBy(by), node, seconds)
        case now.Arrived(i, why) if before.robots[i].command:
            result, reason = MoveEnd.ARRIVED, why or None
        case now.Failed(i, _, why):
            result, reason = MoveEnd.FAILED, why
        case now.Lost(i, found, why):
            result, regions, reason = MoveEnd.LOST, tuple(sorted(found)), why or None
        case now.Elsewhere(i, _, blocked):
            result = MoveEnd.BLOCKED if blocked else MoveEnd.ELSEWHERE
        case _:
            return None
    place = team.members[i].graph.pose(after.robots[i].pose).place
    who = tick, before.robots[i].command, team.members[i].name
    return records.Arrive(*who, *place, result, reason, regions)


def plan_line(tick: int, team: Team, state: State, plan: Plan) -> records.Plan:
    """Return the line of a joint plan from each robot's present waypoint on, without steps that
    change only the memory of formulas."""
    ways, orders, states = {}, list[tuple[str, int, str, int]](), state.robots
    pairs, members = zip(team.members, plan.ways, strict=True), team.members
    every = [[member.graph.pose(visit.pose).place for visit in way] for member, way in pairs]
    number = [[0, *accumulate(a != b for a, b in pairwise(each))] for each in every]
    for i in driven(team, state):
        at, name = states[i].at, members[i].name
        begun = number[i][at]
        kept = dict(zip(number[i], every[i], strict=True))
        ways[name] = tuple(kept[k] for k in range(begun, len(kept)))
        for place in range(at + 1, len(every[i])):
            for j, left in plan.ways[i][place].after:
                since = number[j][left] - number[j][states[j].at]
                if since > 0 and number[i][place] > begun:
                    orders.append((members[j].name, since, name, number[i][place] - begun))
    what = "a part of the mission" if plan.part else "the remaining mission"
    return records.Plan(tick, what, ways, tuple(orders))


def request_line(
    team: Team,
    tick: int,
    state: State,
    k: int,
    helpers: tuple[str, ...],
    control: Control,
    because: str | None = None,
) -> records.Request:
    """Return the line of a request with its helpers. ``because``: why they help, if known."""
    request, there = Request(team, state, control.found, k), state.obstacles[k]
    bids, helping = request.bids(), helpers_of(control.roles, k)
    if because is None and helping:
        because = request.why_others(helping, bids)
    elif because is None:
        because = request.why_nobody(aside=there.aside and k not in control.vain)
    if because is None and helping and k in control.left:
        because = f"the joint plan relies on {listed(helpers)}"
    return records.Request(
        tick,
        team.obstacles[k].name,
        team.members[there.asked[-1][0]].name if there.asked else None,
        bids,
        helpers,
        need=there.stage.need if len(team.obstacles[k].needs) > 1 else None,
        because=because,
    )


def synthesis_line(tick: int, found: Controller, world: RegionMap) -> records.Synthesis:
    """Return the line of the synthesis of a robot's controller."""
    task, result = found.task, found.result
    hashes = result.spec_sha256, result.strategy_sha256
    forbidden = sorted(task.forbidden, key=lambda pose: (pose.region, pose.heading or 0))
    possible = assignable_regions(task, world) if task.assignable else None
    return records.Synthesis(
        tick,
        task.robot.name,
        result.verdict,
        round(result.seconds, 6),
        result.states,
        result.cached,
        result.verified,
        *hashes,
        found.asked,
        tuple(assumption_names(task, world)),
        node=found.node,
        region=task.pose.region,
        heading=task.pose.facing,
        memory=task.begins,
        inputs={each.name: on for each, on in task.inputs} or None,
        closed=tuple((known.region, known.item) for known in task.blocked),
        knowledge={
            other.name: other.region if other.belief is None else tuple(sorted(other.belief))
            for other in task.observed
        },
        beliefs={
            model.other.name: tuple(tuple(sorted(belief)) for belief in model.beliefs)
            for model in models(task, world)
        }
        or None,
        sight_closed=tuple(sorted(task.closed)) if task.observed else None,
        places=None if possible is None else tuple(sorted(possible.places)),
        forbidden=tuple(pose.place for pose in forbidden) or None,
        form=found.form,
        allows=found.allows(world.word),
    )
