"""A robot's knowledge of another one: the region where it sees it, or the cells that may hold it.

Belief abstraction (Bharadwaj, Dimitrova, Topcu: Synthesis of surveillance strategies via belief
abstraction, CDC 2018), which the paper keeps from its predecessor. From a known region, and from
each region of the believed cells, the other may stay or step to a neighbour; in a live run it may
be anywhere within reach, since nothing bounds its steps between two observations. A successor in
sight remains a region; all successors out of sight fold into one belief: the set of cells that
contain one.

The update of knowledge is defined here once, for the specification and for the runtime, so that a
strategy receives exactly the observations for which it was synthesized.

Source: docs/tracking.md. As in the game, the other moves first, and the robot observes from its
region before its own move.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from functools import lru_cache

from msgspec import Struct

from safenav.cached_method import cached_method
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility
from safenav.world.partition import Partition
from safenav.world.poses import Mask, bits, plain_graph, region_mask
from safenav.world.sight import Visibility, visible_from

Belief = frozenset[int]
"""The cells that may hold a robot that is out of sight; never empty."""

Knowledge = Region | Belief
"""The region of another robot, or the cells where it may be."""


class Prospect(Struct, frozen=True):
    """The possible knowledge after the next observation: one of the regions in sight (``seen``), or
    the ``belief`` if the other is out of sight (None: it cannot be)."""

    seen: frozenset[Region]
    belief: Belief | None


class Outlook(Struct, frozen=True):
    """The prospects of one knowledge from all own regions: the other may move to ``reach``;
    ``beliefs`` holds each belief (or None) with the own regions that lead to it."""

    reach: Mask
    beliefs: tuple[tuple[Belief | None, Mask], ...]


class Tracker:
    """Tracking of other robots on a map, by the cells of a partition, with the robot's visibility.
    ``live``: they make any number of steps between two observations, else at most one."""

    def __init__(
        self, world: RegionMap, partition: Partition, visibility: Visibility, live: bool = False
    ) -> None:
        self.world = world
        self.partition = partition
        self.visibility = visibility
        self.live = live
        self._graph = plain_graph(world, Mobility.FREE)
        self._free = self._graph.free_regions
        self._cells = tuple(region_mask(cell) for cell in partition.cells)

    def possible(self, knowledge: Knowledge) -> frozenset[Region]:
        """Return the regions where the other may be."""
        if isinstance(knowledge, frozenset):
            return self.partition.regions(knowledge)
        return frozenset({knowledge})

    def update(self, own: Region, knowledge: Knowledge) -> Prospect:
        """The possible knowledge after the other's next move, observed from region ``own``."""
        outlook = self.outlook(knowledge)
        seen = frozenset(bits(outlook.reach & self.visibility.mask(own)))
        belief = next((b for b, owns in outlook.beliefs if owns >> own & 1), None)
        return Prospect(seen, belief)

    @cached_method
    def outlook(self, knowledge: Knowledge) -> Outlook:
        """Return the prospects from all free regions."""
        return self._look_ahead(self.reach(region_mask(self.possible(knowledge))))

    def spread(self, regions: Mask, within: Mask | None = None) -> Mask:
        """Return the regions one step or none away, in ``within`` (default: all free regions)."""
        around = regions | self._graph.forward(regions)
        return around & (self._free if within is None else within)

    def reach(self, regions: Mask) -> Mask:
        """Return the possible regions of a robot in one of the regions at the next observation."""
        free = self._free
        return self._graph.closure(regions & free, free) if self.live else self.spread(regions)

    @cached_method
    def _look_ahead(self, reach: Mask) -> Outlook:
        """Return the outlook for ``reach``; in a live run, much knowledge shares it."""
        groups: list[tuple[Belief, Mask]] = [(frozenset(), self._free)]
        for cell, regions in enumerate(self._cells):
            if not reach & regions:
                continue
            overseen = self._free  # the own regions that see all reached ones of the cell
            for region in bits(reach & regions):
                overseen &= self.visibility.mask(region)
                if not overseen:
                    break
            groups = [
                part
                for belief, owns in groups
                for part in ((belief, owns & overseen), (belief | {cell}, owns & ~overseen))
                if part[1]
            ]
        return Outlook(reach, tuple((belief or None, owns) for belief, owns in groups))


@lru_cache(maxsize=64)
def watch(
    world: RegionMap,
    partition: Partition,
    radius: float | None,
    closed: frozenset[Region] = frozenset(),
    live: bool = False,
) -> Tracker:
    """Return the tracker, made once; ``radius`` and ``closed`` as in ``visible_from``."""
    return Tracker(world, partition, visible_from(world, radius, closed), live)


class TooManyBeliefsError(ValueError):
    """More beliefs can occur than a specification can handle in reasonable time."""


def occurring(
    watch: Tracker, own: Region, blocked: frozenset[Region], knowledge: Knowledge, most: int
) -> Mapping[Knowledge, Mask]:
    """Return all possible knowledge, each with the own regions in which it may occur.

    From ``knowledge`` in region ``own``; the robot itself steps freely, but not onto
    ``blocked`` regions. Raises TooManyBeliefsError beyond ``most`` beliefs.
    """
    floor = region_mask(watch.world.free) & ~region_mask(blocked) | 1 << own
    found: dict[Knowledge, Mask] = {knowledge: 1 << own}
    fresh: dict[Knowledge, Mask] = dict(found)
    queue: deque[Knowledge] = deque(found)
    beliefs = int(isinstance(knowledge, frozenset))
    while queue:
        known = queue.popleft()
        for after, owns in _following(watch, known, fresh.pop(known)):
            new = watch.spread(owns, floor) & ~found.get(after, 0)
            if not new:
                continue
            if after not in found and isinstance(after, frozenset):
                beliefs += 1
                if beliefs > most:
                    raise TooManyBeliefsError(
                        f"with {len(watch.partition.cells)} cells more than {most} beliefs occur"
                    )
            found[after] = found.get(after, 0) | new
            if after not in fresh:
                queue.append(after)
            fresh[after] = fresh.get(after, 0) | new
    return found


def _following(
    watch: Tracker, knowledge: Knowledge, owns: Mask
) -> Iterator[tuple[Knowledge, Mask]]:
    """Yield the possible next knowledge, each with the robot's own regions that lead to it."""
    outlook = watch.outlook(knowledge)
    for region in bits(outlook.reach):
        seers = owns & watch.visibility.mask(region)
        if seers:
            yield region, seers
    for belief, blind in outlook.beliefs:
        if belief is not None and owns & blind:
            yield belief, owns & blind
