"""Poses of a robot, the steps between them, and reachability.

Results are cached: many robots, at many lines of a trace, make the same queries, and the result for
a pose holds for all poses that reach each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import chain
from typing import NamedTuple

from safenav.audit.language import Pose, closure

Poses = frozenset[Pose]
Walls = frozenset[int]

MOST_KEPT = 2_000_000
"""Limit on the number of poses in the cached results of a graph."""


class Spread(NamedTuple):
    """The poses reachable from a pose, and those of them from which it is reachable."""

    reach: Poses
    around: Poses


class PoseGraph(dict[Pose, tuple[Pose, ...]]):
    """The poses after one step from each pose. ``walls``: regions that are not entered."""

    @cached_property
    def before(self) -> dict[Pose, list[Pose]]:
        """The poses from which one step leads to each pose."""
        found: dict[Pose, list[Pose]] = {}
        for pose, steps in self.items():
            for to in steps:
                found.setdefault(to, []).append(pose)
        return found

    def on(self, regions: Iterable[int]) -> Iterator[Pose]:
        """Yield the poses in some regions."""
        return chain.from_iterable(self._on.get(region, ()) for region in regions)

    @cached_property
    def _on(self) -> dict[int, list[Pose]]:
        found: dict[int, list[Pose]] = {}
        for pose in self:
            found.setdefault(pose[0], []).append(pose)
        return found

    @cached_property
    def _known(self) -> dict[Walls, list[Spread]]:
        return {}

    _kept = 0

    def spread(self, pose: Pose, walls: Walls) -> Spread:
        """Return the spread of a pose. For a pose in a wall, ``around`` has the poses that would
        lead back if its region were free."""
        if self._kept > MOST_KEPT:
            self._known.clear()
            self._kept = 0
        known = self._known.setdefault(walls, [])
        found = next((each for each in known if pose in each.around), None)
        if found is None:
            reach = closure([pose], lambda p: (q for q in self.get(p, ()) if q[0] not in walls))
            there = {*reach}
            back = closure([pose], lambda p: (q for q in self.before.get(p, ()) if q in there))
            around = frozenset(p for p in back if p == pose or p[0] not in walls)
            found = Spread(frozenset(there), around)
            if pose[0] not in walls:
                known.append(found)
                self._kept += len(reach) + len(around)
        return found

    def reach(self, poses: Iterable[Pose], walls: Walls) -> Poses:
        """Return the poses that are reachable from some poses."""
        found: Poses = frozenset()
        left = frozenset(poses)
        while left:
            more = self.spread(next(iter(left)), walls).reach
            found, left = found | more if found else more, left - more
        return found

    def can_continue(self, poses: Iterable[Pose], aims: tuple[Poses, ...], walls: Walls) -> bool:
        """Return whether each of the aims can be met infinitely often from some of the poses:
        whether some reachable poses reach each other and include a pose of each aim."""
        reach, seen = self.reach(poses, walls), set[Pose]()
        for pose in aims[0] & reach if aims else reach:
            if pose[0] not in walls and pose not in seen:
                around = self.spread(pose, walls).around
                if all(aim & around for aim in aims):
                    return True
                seen |= around
        return False
