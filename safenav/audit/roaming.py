"""Where the robots of a team can get, and continue, while some obstacles are walls."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import combinations, product

from safenav.audit.language import Pose, closure
from safenav.audit.members import Duty, Member, OpenObstacle, OpenObstacles, Poses


class Roaming:
    """Reachable poses of each robot; searches are cached."""

    def __init__(self, members: Mapping[str, Member], *, newest_first: bool = False) -> None:
        self.members, self.names, self.newest_first = members, [*members], newest_first
        self._before: dict[str, dict[Pose, list[Pose]]] = {name: {} for name in members}
        for name, member in members.items():
            for pose, steps in member.steps.items():
                for to in steps:
                    self._before[name].setdefault(to, []).append(pose)
        self._reach, self._live = cache(self._reached), cache(self._lively)

    @staticmethod
    def walls(name: str, obstacles: OpenObstacles) -> frozenset[int]:
        return frozenset(obstacle.region for obstacle in obstacles if obstacle.closes(name))

    def reach(self, name: str, poses: Poses, obstacles: OpenObstacles) -> Poses:
        """Return the poses that a robot can reach from some poses."""
        return self._reach(name, poses, self.walls(name, obstacles))

    def around(self, name: str, pose: Pose, obstacles: OpenObstacles) -> Poses:
        """Return the poses that a robot can go back and forth between."""
        there, walls = self.reach(name, frozenset([pose]), obstacles), self.walls(name, obstacles)
        back = closure({pose}, lambda p: (q for q in self._before[name].get(p, ()) if q in there))
        return frozenset(p for p in back if p == pose or p[0] not in walls)

    def goes_on(self, name: str, poses: Poses, obstacles: OpenObstacles) -> bool:
        """Return whether a robot can meet each of its targets infinitely often from some of the
        poses."""
        return bool(
            self.reach(name, poses, obstacles) & self._live(name, self.walls(name, obstacles))
        )

    def is_live(self, name: str, pose: Pose, obstacles: OpenObstacles) -> bool:
        """Return whether a robot can meet each of its targets infinitely often from a pose."""
        return pose in self._live(name, self.walls(name, obstacles))

    def ticks(self, name: str, poses: Poses, there: Poses, obstacles: OpenObstacles) -> int | None:
        """Return an upper bound on the ticks to the nearest of some poses; None if there is no
        path."""
        walls, steps = self.walls(name, obstacles), self.members[name].steps
        seen, edge, count = set(poses), set(poses), 0
        while edge and not edge & there:
            edge = {q for p in edge for q in steps.get(p, ()) if q[0] not in walls} - seen
            seen, count = seen | edge, count + 1
        return count * self.members[name].ticks if edge else None

    def _reached(self, name: str, poses: Poses, walls: frozenset[int]) -> Poses:
        steps = self.members[name].steps
        ways = closure(poses, lambda p: (q for q in steps.get(p, ()) if q[0] not in walls))
        return frozenset(ways)

    def _lively(self, name: str, walls: frozenset[int]) -> Poses:
        before = self._before[name]
        kept = frozenset(p for p in self.members[name].steps if p[0] not in walls)

        def back(pose: Pose) -> Iterator[Pose]:
            return (one for one in before.get(pose, ()) if one in kept)

        while True:
            size = len(kept)
            for aim in self.members[name].aims:
                kept = frozenset(closure(aim & kept, back))
            if len(kept) == size:
                return kept

    def full(self, obstacles: Iterable[OpenObstacle]) -> frozenset[str]:
        """Return the robots that carry as many loads as they can."""
        loads = [name for obstacle in obstacles for name in obstacle.carriers()]
        return frozenset(n for n in self.names if loads.count(n) >= self.members[n].room)

    def fits(self, group: Iterable[str], at: Mapping[str, Poses]) -> bool:
        """Return whether all can stand there at the same time, those in conflict in different
        regions."""
        crowd = [name for name in group if self.members[name].rivals & {*group}]
        ways = product(*({region for region, _ in at[name]} for name in crowd))
        return any(
            all(
                one != other or b not in self.members[a].rivals
                for (a, one), (b, other) in combinations(zip(crowd, way, strict=True), 2)
            )
            for way in ways
        )

    def in_the_way(
        self,
        name: str,
        region: int,
        at: Mapping[str, Pose],
        obstacles: OpenObstacles,
        duties: Mapping[str, Duty],
    ) -> bool:
        """Return whether a robot that stood in a region would keep a helper in conflict with it
        from every region of its duty, or a group from standing there together."""
        for helper in self.members[name].rivals & {*duties}:
            duty = duties[helper]
            stood = next(o for o in obstacles if o.name == duty.obstacle)
            places = {}
            for one in duty.group:
                shut = {region} if one in self.members[name].rivals else set()
                walls = self.walls(one, obstacles) | shut
                goal = duties.get(one, duty).regions - shut
                reached = self._reach(one, frozenset([at[one]]), walls)
                places[one] = frozenset(pose for pose in reached if pose[0] in goal)
            together = stood.left[0].together
            if not all(places.values()) or (together and not self.fits(duty.group, places)):
                return True
        return False

    def clear(
        self,
        name: str,
        at: Mapping[str, Pose],
        obstacles: OpenObstacles,
        duties: Mapping[str, Duty],
    ) -> frozenset[int]:
        """Return the regions that a robot can reach in which it is in no helper's way."""
        reached = {region for region, _ in self.reach(name, frozenset([at[name]]), obstacles)}
        return frozenset(r for r in reached if not self.in_the_way(name, r, at, obstacles, duties))
