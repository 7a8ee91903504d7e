"""Whether a robot can get to the targets of its objective, and from one to the next forever.

This is about the modelled map and the robot alone; that a controller exists against all that
the environment may do is for synthesis to say. Poses are numbers (region * 4 + heading), so
that a map of a quarter of a million regions takes seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from safenav.scenario.objective import Target
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Mobility, Pose

_HEADINGS = len(Heading)


class Reachability:
    """The regions that a robot of one mobility can reach from its start without entering ``closed``
    ones."""

    def __init__(
        self,
        mobility: Mobility,
        start: Pose,
        world: RegionMap,
        closed: Collection[Region] = frozenset(),
    ) -> None:
        self._mobility = mobility
        self._world = world
        self._shut = frozenset(world.walls) | frozenset(closed)
        self._reached = _explore([_code(start)], self._after)

    def reaches(self, target: Target) -> bool:
        """Whether some region of the target can be reached."""
        return any(pose in self._reached for pose in self._poses(target))

    def follows(self, targets: Sequence[Target]) -> bool:
        """Whether the robot can visit the targets once, one after the other."""
        reached = self._reached
        for target in targets:
            there = [pose for pose in self._poses(target) if pose in reached]
            if not there:
                return False
            reached = _explore(there, self._after)
        return True

    def recurs(self, targets: Collection[Target]) -> bool:
        """Whether the robot can visit all the targets infinitely often: whether some strongly
        connected set of poses within reach meets every one of them."""
        if self._mobility is Mobility.FREE or len(set(targets)) < 2:
            return all(self.reaches(target) for target in targets)  # every step has a way back
        poses: list[frozenset[int]] = [
            frozenset(self._poses(target)) & self._reached for target in targets
        ]
        fewest = min(poses, key=len)
        open_poses = set(fewest)
        while open_poses:
            pose = open_poses.pop()
            component = _explore([pose], self._after) & _explore([pose], self._before)
            if all(component & wanted for wanted in poses):
                return True
            open_poses -= component
        return False

    def _poses(self, target: Target) -> list[int]:
        return [region * _HEADINGS + heading for region in target for heading in range(_HEADINGS)]

    def _after(self, pose: int) -> list[int]:
        region, heading = divmod(pose, _HEADINGS)
        back = (heading + 2) % _HEADINGS
        if self._mobility is Mobility.FREE:
            return [beside * _HEADINGS for _, beside in self._beside(region)]
        return [beside * _HEADINGS + step for step, beside in self._beside(region) if step != back]

    def _before(self, pose: int) -> list[int]:
        """Under heading mobility a pose is entered from behind, in three headings."""
        region, heading = divmod(pose, _HEADINGS)
        back = (heading + 2) % _HEADINGS
        return [
            behind * _HEADINGS + turned
            for step, behind in self._beside(region)
            if step == back
            for turned in range(_HEADINGS)
            if turned != back
        ]

    def _beside(self, region: Region) -> list[tuple[int, Region]]:
        """(heading, region) of the free neighbours."""
        cols, walls = self._world.cols, self._shut
        col = region % cols
        found = []
        if region >= cols and region - cols not in walls:
            found.append((0, region - cols))
        if col + 1 < cols and region + 1 not in walls:
            found.append((1, region + 1))
        if region + cols < self._world.size and region + cols not in walls:
            found.append((2, region + cols))
        if col and region - 1 not in walls:
            found.append((3, region - 1))
        return found


def _code(pose: Pose) -> int:
    return pose.region * _HEADINGS + (int(pose.heading) if pose.heading is not None else 0)


def _explore(start: list[int], after: Callable[[int], list[int]]) -> set[int]:
    seen = set(start)
    stack = list(start)
    while stack:
        for pose in after(stack.pop()):
            if pose not in seen:
                seen.add(pose)
                stack.append(pose)
    return seen
