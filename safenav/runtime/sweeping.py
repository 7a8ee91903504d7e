"""The regions that robots must not enter: occupied by others, swept by a resolution, or named by
reports that have no effect yet."""

from __future__ import annotations

from safenav.runtime.coordination.snapshot import takers
from safenav.runtime.deadlines.choice import InTime
from safenav.runtime.failures import stands_for
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.scenario.model import Obstacle, Robot
from safenav.world.map import Region


def taken(team: TeamState, robot: Robot) -> set[Region]:
    """Return the regions that a robot must not enter now: those occupied by robots in conflict with
    it, ``never_together`` zones in use, and ``swept`` ones."""
    return team.had_by_others(robot) | swept(team, robot)


def claimed_beside(team: TeamState, robot: RobotState) -> bool:
    """Whether, by a report that has no effect yet, another robot may be in an adjacent region that
    is still open to this one. Until the report takes effect, this robot must not set out."""
    claiming = [o for o in team.robots.values() if o.claims and o is not robot]
    if not claiming:
        return False
    sides = team.scenario.map.neighbours(robot.pose.region)
    beside = {*sides} - team.had_by_others(robot.robot, sides)
    return any(
        region in beside and (not names or robot.name in names)
        for other in claiming
        for region, names in other.claims.items()
    )


def swept(team: TeamState, robot: Robot) -> set[Region]:
    """The regions swept by a resolution under way in which this robot takes no part; and those of
    obstacles that it would resolve by entering while another robot is in the swept regions."""
    found = set[Region]()
    for work in team.knowledge.pending.values():
        obstacle = work.obstacle
        if not (sweeps := obstacle.swept(team.scenario.map)):
            continue
        resolving = _resolving(team, obstacle)
        if resolving and robot.name not in resolving:
            found |= sweeps
        need = team.knowledge.need_of(obstacle)
        if obstacle.resolved_by_entering(robot, need) and not clear_of(team, obstacle, robot):
            found.add(obstacle.region)
    return found


def _resolving(team: TeamState, obstacle: Obstacle) -> set[str]:
    """The robots that act on an obstacle; if there are none, those that have entered its region to
    resolve it."""
    need, acting, inside = team.knowledge.need_of(obstacle), set[str](), set[str]()
    for name, state in team.robots.items():
        lead = team.robots.get(state.acting or "")
        if lead is not None and obstacle in lead.acts_on:
            acting.add(name)
        if obstacle.region in state.occupied and obstacle.resolved_by_entering(state.robot, need):
            inside.add(name)
    return acting or inside


def leading(team: TeamState, obstacle: Obstacle) -> set[str]:
    """The robots that lead an action on an obstacle."""
    robots = team.robots.items()
    return {name for name, r in robots if r.acting == name and obstacle in r.acts_on}


def clear_of(team: TeamState, obstacle: Obstacle, robot: Robot) -> bool:
    """Whether no other robot is, or may be lost, in the regions that an obstacle sweeps."""
    sweeps = obstacle.swept(team.scenario.map)
    if not sweeps:
        return True
    others = {name: state for name, state in team.robots.items() if name != robot.name}
    known = team.knowledge.obstacles.values()
    closed = {o.region for o in known if any(stands_for(o, name) for name in others)}
    return sweeps.isdisjoint(closed.union(*(o.occupied | {*o.claims} for o in others.values())))


def cleared(team: TeamState, robot: Robot, chosen: InTime | None = None) -> list[Obstacle]:
    """The known obstacles that sweep regions or are loads to be taken, and that a robot may act on
    now: no other robot is where they sweep, and a robot that is sent for a load keeps room for it.
    ``chosen``: the acts chosen for deadlines."""
    pending = team.knowledge.pending.values()
    assignment, here = team.robots[robot.name].assignment, team.robots[robot.name].pose.region
    sent_for = assignment.obstacle if assignment.role is Role.HELPS else None
    may = takers(team, {}, (work.obstacle for work in pending if work.takes))
    left = {name for name, robots in may.items() if robot.name not in robots}
    loads = team.knowledge.to_take(robot, sent_for, here, left)
    if chosen is not None:
        mine = chosen.next_at(team.last_settled.floor, robot.name, here)
        if mine is not None:
            loads = [work.obstacle for work in pending if work.obstacle.name in mine]
    return [
        work.obstacle
        for work in pending
        if (work.obstacle in loads if work.takes else work.obstacle.swept(team.scenario.map))
        and clear_of(team, work.obstacle, robot)
    ]
