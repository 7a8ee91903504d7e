"""The poses of one robot alone, as sets of bits: reachable ones, and those from which it can
continue."""

from collections.abc import Iterable

from campaigns.judge.mission import HEADINGS, Mission, Pose, Robot


class Poses:
    """The graph of one robot's poses on the free map. Sets of poses are integers, bit by bit."""

    def __init__(self, mission: Mission, robot: Robot) -> None:
        self.robot = robot
        headings = range(len(HEADINGS)) if robot.has_heading else (-1,)
        allowed = sorted(mission.free - robot.forbidden)
        self.poses: list[Pose] = [(r, h) for r in allowed for h in headings]
        self.index = {pose: k for k, pose in enumerate(self.poses)}
        self.successors = [
            [self.index[to] for to in mission.steps(robot, pose)] for pose in self.poses
        ]
        self.predecessors: list[list[int]] = [[] for _ in self.poses]
        for origin, reached in enumerate(self.successors):
            for to in reached:
                self.predecessors[to].append(origin)
        self._live: dict[frozenset[int], int] = {}

    def at(self, regions: Iterable[int]) -> int:
        """All poses in these regions."""
        wanted = set(regions)
        return sum(1 << k for k, (region, _) in enumerate(self.poses) if region in wanted)

    def closure(self, start: int, walls: frozenset[int]) -> int:
        """Return the poses reachable from ``start`` without entering ``walls``."""
        return self._spread(start, ~self.at(walls), self.successors)

    def live(self, walls: frozenset[int]) -> int:
        """The greatest set of poses from which every target (the last one if the robot stays there)
        can be reached within the set."""
        known = self._live.get(walls)
        if known is not None:
            return known
        inside = ~self.at(walls) & ((1 << len(self.poses)) - 1)
        targets = self.robot.targets[-1:] if self.robot.stays else self.robot.targets
        goals = [self.at(target) for target in targets]
        while True:
            before = inside
            for goal in goals:
                inside &= self._spread(goal & inside, inside, self.predecessors)
            if inside == before:
                self._live[walls] = inside
                return inside

    def distances(self, target: frozenset[int]) -> dict[Pose, int]:
        """Return the number of steps to the target from each pose, without obstacles."""
        level = [k for k, (region, _) in enumerate(self.poses) if region in target]
        found = dict.fromkeys(level, 0)
        steps = 0
        while level:
            steps += 1
            level = sorted({b for k in level for b in self.predecessors[k]} - found.keys())
            found.update(dict.fromkeys(level, steps))
        return {self.poses[k]: distance for k, distance in found.items()}

    @staticmethod
    def _spread(start: int, inside: int, edges: list[list[int]]) -> int:
        """Return the poses that edges reach from ``start``, entering only ``inside``."""
        found = start
        pending = [k for k in range(start.bit_length()) if start >> k & 1]
        while pending:
            for to in edges[pending.pop()]:
                bit = 1 << to
                if not found & bit and inside & bit:
                    found |= bit
                    pending.append(to)
        return found
