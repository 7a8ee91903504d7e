"""The poses of a robot and the steps between them, and what can be reached.

Many robots of a team, at many lines of a trace, ask for the same: what was found for a pose also
holds for all that can reach each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import chain
from typing import NamedTuple

from safenav.audit.language import Pose, closure

Poses = frozenset[Pose]
Walls = frozenset[int]

MOST_KEPT = 2_000_000
"""Poses in the results that a graph keeps."""


class Spread(NamedTuple):
    """The poses that one can reach, and those of them from which it can be reached."""

    reach: Poses
    around: Poses


class PoseGraph(dict[Pose, tuple[Pose, ...]]):
    """The poses after one step from each pose. ``walls``: regions that are not entered."""

    @cached_property
    def before(self) -> dict[Pose, list[Pose]]:
        """Return for each pose those from which one step leads there."""
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
        """Return what can be reached from a pose. From one in a wall, ``around`` has the poses that
        would lead back if it were none."""
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
        """Return the poses that can be reached from some poses."""
        found: Poses = frozenset()
        left = frozenset(poses)
        while left:
            more = self.spread(next(iter(left)), walls).reach
            found, left = found | more if found else more, left - more
        return found

    def can_continue(self, poses: Iterable[Pose], aims: tuple[Poses, ...], walls: Walls) -> bool:
        """Return whether each of the aims can be met infinitely often from some of the poses:
        whether there are poses that can reach each other among which are some of each aim."""
        reach, seen = self.reach(poses, walls), set[Pose]()
        for pose in aims[0] & reach if aims else reach:
            if pose[0] not in walls and pose not in seen:
                around = self.spread(pose, walls).around
                if all(aim & around for aim in aims):
                    return True
                seen |= around
        return False
