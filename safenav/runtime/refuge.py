"""Refuges: where robots could stand aside so that another one gets on.

Searches on the map only; whether a robot has a strategy for going there is asked afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from safenav.runtime.state import TeamState
from safenav.scenario.model import Robot
from safenav.world.map import Region
from safenav.world.moves import distances

DEPTH = 3
"""Robots that may have to give way together (the one behind first)."""


Places = tuple[tuple[str, Region], ...]
"""Who goes where, the one that must go first first."""


@dataclass(frozen=True)
class Deadlock:
    """``stuck`` cannot get on; ``ring`` are the robots that it waits for, nearest first."""

    stuck: str
    ring: tuple[str, ...]


@dataclass(frozen=True)
class Refuge:
    """Where each robot that gives way goes, so that ``stuck`` has a way; ``cost`` in steps."""

    stuck: str
    places: Places
    cost: int


def refuges(deadlock: Deadlock, state: TeamState) -> Iterator[Refuge]:
    """Ways out of a deadlock, cheapest first: who gives way to whom, and where it goes.

    First with everybody else standing where they are, then as if those who are not part of the
    deadlock were out of the way.
    """
    names = (deadlock.stuck, *deadlock.ring)
    for others_stand in (True, False):
        found = [refuge for stuck in names for refuge in _ways(stuck, names, state, others_stand)]
        yield from sorted(found, key=lambda refuge: refuge.cost)


def _ways(
    stuck: str, names: tuple[str, ...], state: TeamState, others_stand: bool
) -> Iterator[Refuge]:
    """For one robot that is to get on: the nearest refuge for each that could give way, also
    with others giving way to that one first."""
    robot = state.scenario.robot(stuck)
    awaited = state.tasks.current[stuck].progress.awaited()
    if not awaited or state.region(robot) in awaited:
        return
    fixed = {
        other.name: state.next_pose(other).region
        for other in state.scenario.robots
        if other.name != stuck
        and state.scenario.conflict(robot, other)
        and (others_stand or other.name in names)
    }
    for name in names:
        if name in fixed:
            places = _give_way(name, fixed, robot, awaited, state, DEPTH)
            if places is not None:
                yield Refuge(stuck, *places)


def _give_way(
    name: str,
    fixed: Mapping[str, Region],
    robot: Robot,
    awaited: frozenset[Region],
    state: TeamState,
    depth: int,
) -> tuple[Places, int] | None:
    """Where ``name`` must go so that ``robot`` reaches what it awaits, and the cost. If its way
    is barred, those behind it go first. None if there is no such place."""
    mover = state.scenario.robot(name)
    here = state.next_pose(robot).region
    others = {region for other, region in fixed.items() if other != name}
    reach = distances(
        mover.model.mobility,
        state.next_pose(mover),
        state.scenario.map,
        others | {here} | known_regions(mover, state),
    )
    for place in sorted(reach, key=lambda region: (reach[region], region)):
        if place == here or place in awaited or place == fixed[name]:
            continue
        if _gets_there(robot, awaited, others | {place}, state):
            return ((name, place),), reach[place]
    if depth == 1:
        return None
    best: tuple[Places, int] | None = None
    for behind in fixed:
        if behind == name:
            continue
        freed = _step_aside(behind, name, fixed, robot, state)
        for place, cost in freed:
            moved = {**fixed, behind: place}
            rest = _give_way(name, moved, robot, awaited, state, depth - 1)
            if rest is not None and (best is None or rest[1] + cost < best[1]):
                best = (((behind, place), *rest[0]), rest[1] + cost)
                break
    return best


def _step_aside(
    behind: str, name: str, fixed: Mapping[str, Region], robot: Robot, state: TeamState
) -> list[tuple[Region, int]]:
    """Places that ``behind`` can go to, nearest first, so that ``name`` has more room."""
    mover = state.scenario.robot(behind)
    others = {region for other, region in fixed.items() if other != behind}
    reach = distances(
        mover.model.mobility,
        state.next_pose(mover),
        state.scenario.map,
        others | {state.next_pose(robot).region} | known_regions(mover, state),
    )
    del name
    places = sorted((distance, region) for region, distance in reach.items() if distance)
    return [(region, distance) for distance, region in places[:64]]


def _gets_there(
    robot: Robot, awaited: frozenset[Region], taken: set[Region], state: TeamState
) -> bool:
    reach = distances(
        robot.model.mobility,
        state.next_pose(robot),
        state.scenario.map,
        taken | known_regions(robot, state),
    )
    return any(region in reach for region in awaited)


def known_regions(robot: Robot, state: TeamState) -> set[Region]:
    """The regions beyond the walls that a robot keeps out of now."""
    avoid = state.tasks.current[robot.name].avoid
    return {known.region for known in state.knowledge.known_for(robot, avoid)}
