"""Robots whose objectives end where there is no room for all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from safenav.scenario.model import Robot
from safenav.world.map import Region, RegionMap


def without_room(robots: Sequence[Robot]) -> Iterator[tuple[Robot, ...]]:
    """Yield groups of robots that must stay in fewer regions than they are, each in conflict with
    all others of its group; at most one for each greatest set of such robots."""
    stay = [robot for robot in robots if robot.objective.settles]
    seen = list[set[str]]()
    for first in stay if _too_many(stay) else ():
        apart = [first]
        for robot in stay:
            if robot is not first and all(robot.conflicts(other) for other in apart):
                apart.append(robot)
        names = {robot.name for robot in apart}
        if names not in seen:
            seen.append(names)
            if group := _too_many(apart):
                yield group


def _too_many(robots: Sequence[Robot]) -> tuple[Robot, ...]:
    """Return the first robots that cannot all be in different regions of their last targets; empty
    if all can (bipartite matching)."""
    taken: dict[Region, Robot] = {}

    def place(robot: Robot, tried: set[Region]) -> bool:
        for region in sorted(robot.objective.targets[-1] - tried):
            tried.add(region)
            if region not in taken or place(taken[region], tried):
                taken[region] = robot
                return True
        return False

    for robot in robots:
        tried = set[Region]()
        if not place(robot, tried):  # the robots in the regions that were tried fit nowhere else
            group = [robot, *(taken[region] for region in tried)]
            return tuple(each for each in robots if each in group)
    return ()


def room_words(group: Sequence[Robot], world: RegionMap) -> str:
    """Return in words that such a group has no room."""
    names = [robot.name for robot in group]
    who = f"{', '.join(names[:-1])} and {names[-1]} must {'both' if len(names) == 2 else 'all'}"
    regions = sorted(frozenset[Region]().union(*(robot.objective.targets[-1] for robot in group)))
    places = [world.label(region) for region in regions]
    if len(places) == 1:
        return f"{who} stay at {places[0]}, but it has room for one robot"
    where = f"{', '.join(places[:-1])} and {places[-1]}"
    return f"{who} stay at {where}, but these regions have room for {len(places)} robots"
