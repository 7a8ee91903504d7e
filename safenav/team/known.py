"""The floor as the team knows it now: open and sealed obstacles, and robots in service."""

from collections.abc import Collection
from functools import lru_cache

from safenav.team.floor import Floor, Inside, Stages, carrying
from safenav.team.state import Is, State
from safenav.team.team import Team


def inside(team: Team, state: State) -> frozenset[Inside]:
    """Return an entry for each robot in, or in transit to, an obstacle that is closed to it."""
    found = set[Inside]()
    for k, each in enumerate(state.obstacles):
        obstacle = team.obstacles[k]
        for i in obstacle.blocks if each.stands else ():
            robot, back = state.robots[i], turns_back(team, state, i, k)
            if (back or obstacle.closes(i, each)) and robot.next % team.size == obstacle.region:
                behind = robot.behind if robot.to is None else robot.pose % team.size
                found.add((i, k, robot.next, behind if back else None))
    return frozenset(found)


def turns_back(team: Team, state: State, i: int, k: int) -> bool:
    """Return whether a robot in an obstacle must back out, since it has failed to resolve the
    obstacle, or an operator has declared that permanent."""
    each, obstacle = state.obstacles[k], team.obstacles[k]
    failed = each.known and i in obstacle.blocks and (i, k) in barred(team, state)
    return failed or (each.state is Is.SEALED and obstacle.lets_in(i, each))


def charged(team: Team, state: State, i: int) -> bool:
    """Return whether a robot that ran out of charge returns, since it now has another battery."""
    robot, energy = state.robots[i], team.members[i].energy
    return robot.flat and energy is not None and robot.charge >= energy.battery.capacity


def floor_now(team: Team, state: State) -> Floor:
    """Return the floor as the team knows it, with the robots in service."""
    every = enumerate(state.robots)
    away = ((i, robot) for i, robot in every if not robot.active and not charged(team, state, i))
    out = frozenset((i, robot.next) for i, robot in away)
    return floor_with(team, state, state.gates, state.sealed, out)


def acting_floor(team: Team, state: State, among: Collection[int] | None = None) -> Floor:
    """Return the floor with the obstacles ``among``, or all known ones, on which robots can act."""
    known = (k for k, each in enumerate(state.obstacles) if each.known)
    return floor_with(team, state, tuple(sorted(known if among is None else among)))


def floor_with(
    team: Team,
    state: State,
    gates: tuple[int, ...],
    sealed: frozenset[int] = frozenset(),
    out: frozenset[tuple[int, int]] = frozenset(),
) -> Floor:
    """Return the present floor as if exactly ``gates`` were open, and ``sealed`` obstacles
    permanent. ``out``: the robots out of service, each with its pose."""
    full = frozenset[int]()
    for k, each in enumerate(state.obstacles):
        need = team.obstacles[k].next(each.stage) if each.known or each.stands else None
        if need is not None and k not in gates:
            full |= carrying(need, each.stage)
    return floor_of(team, gates, sealed, inside(team, state), barred(team, state), out, full)


@lru_cache(maxsize=256)
def floor_of(
    team: Team,
    gates: tuple[int, ...],
    sealed: frozenset[int],
    inside: frozenset[Inside],
    barred: frozenset[tuple[int, int]] = frozenset(),
    out: frozenset[tuple[int, int]] = frozenset(),
    laden: frozenset[int] = frozenset(),
) -> Floor:
    """Return the floor on which these obstacles are open and sealed."""
    graphs, floors, within, standing, absent = [], [], [], dict(out), []
    robots = tuple(i for i in range(len(team.members)) if i not in standing)
    at = [1 << standing[i] % team.size if i in standing else 0 for i in range(len(team.members))]
    flat = {team.obstacles[k].battery_of for k in gates}
    for i, member in enumerate(team.members):
        graph = member.graph
        closed = [team.obstacles[k].region for k in sealed if i in team.obstacles[k].blocks]
        taken, whole = graph.poses_on(member.closed(at)), member.floor & ~graph.on(closed)
        floor = whole & ~taken
        absent.append(whole & taken)
        there = tuple(sorted(each for each in inside if each[0] == i))
        for _, k, pose, behind in there:  # a robot that stands there may leave
            floor |= 1 << pose
            graph = graph.left_only(pose, behind) if k in sealed else graph
        graphs.append(graph)
        floors.append(1 << standing[i] if i in standing and i not in flat else floor)
        within.append(there)
    found = team, gates, tuple(graphs), tuple(floors), robots, barred, tuple(within)
    return Floor(*found, away=tuple(absent) if out else (), laden=laden)


def stages_of(floor: Floor, state: State) -> Stages:
    return tuple(state.obstacles[k].stage for k in floor.gates)


def barred(team: Team, state: State) -> frozenset[tuple[int, int]]:
    """Return the pairs of a robot and an obstacle on which its actions have failed too often."""
    pairs = state.attempts
    return frozenset(pair for pair in pairs if pairs.count(pair) >= team.scenario.failures.actions)
