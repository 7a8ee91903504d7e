"""Reachability of targets, once and infinitely often, and room for the robots that stay at them.

It considers the modelled map and the robot alone; synthesis decides whether a strategy exists
against the environment.
"""

from collections.abc import Collection, Iterator, Sequence

from safenav.scenario.model import Robot
from safenav.scenario.objective import Target
from safenav.world.map import Region, RegionMap
from safenav.world.poses import Mobility, Pose, bits, plain_graph


class Reachability:
    """The regions that a robot of one mobility can reach from its start outside ``closed`` ones."""

    def __init__(
        self,
        mobility: Mobility,
        start: Pose,
        world: RegionMap,
        closed: Collection[Region] = frozenset(),
    ) -> None:
        self._graph = graph = plain_graph(world, mobility)
        self._allowed = graph.outside(closed)
        self._reached = graph.closure(1 << graph.number(start), self._allowed)

    @property
    def regions(self) -> frozenset[Region]:
        """The regions that can be reached."""
        return frozenset(bits(self._graph.regions_of(self._reached)))

    def reaches(self, target: Target) -> bool:
        """Return whether some region of the target can be reached."""
        return bool(self._graph.on(target) & self._reached)

    def follows(self, targets: Sequence[Target]) -> bool:
        """Return whether the robot can visit the targets once, one after the other."""
        reached = self._reached
        for target in targets:
            reached = self._graph.closure(self._graph.on(target) & reached, self._allowed)
        return bool(reached)

    def recurs(self, targets: Collection[Target]) -> bool:
        """Return whether the robot can visit all the targets infinitely often."""
        if not self._graph.one_way or len(set(targets)) < 2:
            return all(map(self.reaches, targets))  # every step can be undone
        return bool(self._graph.live(self._graph.on_each(targets), self._reached))


def without_room(robots: Sequence[Robot]) -> Iterator[tuple[Robot, ...]]:
    """Yield groups of robots that outnumber the regions of their last targets. Each robot is in
    conflict with all others of its group. Each maximal set of such robots has at most one group."""
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
    """Return the indices of some robots that cannot all be in different regions, each in one of its
    ``choices``; empty if all robots can (bipartite matching)."""
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
        if not place(one, tried):  # the robots in the tried regions fit nowhere else
            return sorted({one, *(taken[region] for region in tried)})
    return []


def room_words(group: Sequence[Robot], world: RegionMap) -> str:
    """Return a sentence stating that the regions of a group's last targets have no room for it."""
    names = [robot.name for robot in group]
    who = f"{', '.join(names[:-1])} and {names[-1]} must {'both' if len(names) == 2 else 'all'}"
    regions = sorted(frozenset[Region]().union(*(robot.objective.targets[-1] for robot in group)))
    places = " or ".join(map(world.label, regions))
    return f"{who} stay at {places}, but a region has room for one robot"
