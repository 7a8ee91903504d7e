"""Room for the robots that stay at their last targets."""

from collections.abc import Collection, Iterator, Sequence

from safenav.scenario.model import Robot
from safenav.world.map import Region, RegionMap


def without_room(robots: Sequence[Robot]) -> Iterator[tuple[Robot, ...]]:
    """Yield groups of robots that outnumber the regions of their last targets. The robots of a
    group are rivals of each other. Each maximal set of such rivals has at most one group."""
    stay = [robot for robot in robots if robot.objective.settles]
    seen = list[set[str]]()
    for first in stay if too_many(_last(stay)) else ():
        apart = [first]
        for robot in stay:
            if robot is not first and all(robot.conflicts(other) for other in apart):
                apart.append(robot)
        names = {robot.name for robot in apart}
        if names not in seen:
            seen.append(names)
            if group := too_many(_last(apart)):
                yield tuple(apart[number] for number in group)


def _last(robots: Sequence[Robot]) -> list[list[Region]]:
    return [sorted(robot.objective.targets[-1]) for robot in robots]


def too_many(choices: Sequence[Collection[Region]]) -> list[int]:
    """Return the indices of some robots whose ``choices`` do not allow all of them different
    regions; empty if all robots can be in different ones (bipartite matching)."""
    taken: dict[Region, int] = {}

    def place(one: int, tried: set[Region]) -> bool:
        for region in choices[one]:
            if region not in tried:
                tried.add(region)
                if region not in taken or place(taken[region], tried):
                    taken[region] = one
                    return True
        return False

    for one in range(len(choices)):
        tried = set[Region]()
        if not place(one, tried):  # the robots in the tried regions fit in no others
            return sorted({one, *(taken[region] for region in tried)})
    return []


def room_words(group: Sequence[Robot], world: RegionMap) -> str:
    """Return a sentence stating that the regions of a group's last targets have no room for it."""
    names = [robot.name for robot in group]
    who = f"{', '.join(names[:-1])} and {names[-1]} must {'both' if len(names) == 2 else 'all'}"
    regions = sorted(frozenset[Region]().union(*(robot.objective.targets[-1] for robot in group)))
    places = " or ".join(map(world.label, regions))
    return f"{who} stay at {places}, but a region has room for one robot"
