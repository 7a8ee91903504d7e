"""Reachability of targets, once and infinitely often.

It considers only the modelled map and the robot. Synthesis decides whether a strategy exists
against the environment.
"""

from collections.abc import Collection, Sequence

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

    def reaches(self, target: frozenset[Region]) -> bool:
        """Return whether some region of the target can be reached."""
        return bool(self._graph.on(target) & self._reached)

    def follows(self, targets: Sequence[frozenset[Region]]) -> bool:
        """Return whether the robot can visit the targets once, one after another."""
        reached = self._reached
        for target in targets:
            reached = self._graph.closure(self._graph.on(target) & reached, self._allowed)
        return bool(reached)

    def recurs(self, targets: Collection[frozenset[Region]]) -> bool:
        """Return whether the robot can visit all targets infinitely often."""
        if not self._graph.one_way or len(set(targets)) < 2:
            return all(map(self.reaches, targets))  # every step can be undone
        return bool(self._graph.live(self._graph.on_each(targets), self._reached))
