"""Exhaustive search for whether a team can complete a mission.

A state has the pose and progress of each robot and the stage of each obstacle. One robot moves at a
time, into a region without a robot in conflict with it. Robots perform actions wherever they can.
The mission is complete when all have met their objectives ``rounds`` times since the last
resolution, those that stay at their last target are there, and each could go on by itself. States
that seem nearer to that come first; the answer ``NO`` means that all states have been visited.
"""

import heapq
from collections.abc import Iterable, Iterator
from itertools import product

from campaigns.judge.mission import (
    FIRST,
    HEADINGS,
    Answer,
    Mission,
    Need,
    Pose,
    Progress,
    Robot,
    Situation,
    Stage,
    walls,
)

Stages = tuple[tuple[str, Stage], ...]
State = tuple[tuple[Pose, ...], tuple[Progress, ...], Stages]


def can_complete(mission: Mission, begin: Situation, budget: int = 200_000) -> Answer:
    """Return whether the team can complete the mission. ``budget``: states at most."""
    return JointState(mission, begin).search(budget)


class JointState:
    """The states of a mission from some situation on."""

    def __init__(self, mission: Mission, begin: Situation) -> None:
        self.mission = mission
        self.begin = begin
        self.robots = mission.robots
        names = [robot.name for robot in self.robots]
        self.rivals = [[names.index(other) for other in mission.conflicts[name]] for name in names]
        self.graphs = [Poses(mission, robot) for robot in self.robots]
        self.ways = [
            [graph.distances(target) for target in robot.targets]
            for graph, robot in zip(self.graphs, self.robots, strict=True)
        ]
        self._walls: dict[Stages, list[frozenset[int]]] = {}

    def search(self, budget: int) -> Answer:
        """Best first, each state once."""
        queue: list[tuple[float, int, State]] = []
        seen: set[State] = set()
        for state in self.starts():
            if state not in seen:
                seen.add(state)
                heapq.heappush(queue, (self._distance(state), len(seen), state))
        while queue:
            _, _, state = heapq.heappop(queue)
            if self.is_complete(state):
                return Answer.YES
            for after in self.successors(state):
                if after not in seen:
                    if len(seen) >= budget:
                        return Answer.OVER_BUDGET
                    seen.add(after)
                    heapq.heappush(queue, (self._distance(after), len(seen), after))
        return Answer.NO

    def starts(self) -> list[State]:
        """The state itself, and where a patrol has met nothing yet, its other order, too."""
        choices = []
        for robot in self.robots:
            first = self.begin.progress[robot.name]
            free = robot.either_first and robot.in_order and first == (0, 0)
            choices.append([(k, 0) for k in range(len(robot.targets))] if free else [first])
        poses = tuple(self.begin.poses[robot.name] for robot in self.robots)
        stages = tuple(sorted(self.begin.stages.items()))
        return [self._settled(poses, progress, stages) for progress in product(*choices)]

    def successors(self, state: State) -> Iterator[State]:
        poses, progress, stages = state
        closed = self._closed(stages)
        for k, robot in enumerate(self.robots):
            taken = {poses[other][0] for other in self.rivals[k]}
            for pose in self.mission.steps(robot, poses[k]):
                if pose[0] not in taken and pose[0] not in closed[k]:
                    yield self._settled((*poses[:k], pose, *poses[k + 1 :]), progress, stages)

    def is_complete(self, state: State) -> bool:
        poses, progress, stages = state
        closed = self._closed(stages)
        return all(
            self._rounds(robot, met) >= self.mission.rounds
            and (not robot.stays or poses[k][0] in robot.targets[-1])
            and graph.live(closed[k]) >> graph.index[poses[k]] & 1
            for k, (robot, graph, met) in enumerate(
                zip(self.robots, self.graphs, progress, strict=True)
            )
        )

    def _closed(self, stages: Stages) -> list[frozenset[int]]:
        known = self._walls.get(stages)
        if known is None:
            named = dict(stages)
            known = [walls(self.mission, r.name, named, self.begin.sealed) for r in self.robots]
            self._walls[stages] = known
        return known

    def _settled(
        self, poses: tuple[Pose, ...], progress: tuple[Progress, ...], stages: Stages
    ) -> State:
        """Return a state after all that robots do at their poses: actions, then goals."""
        named = dict(stages)
        resolved = False
        for name, stage in stages:
            now: Stage | None = stage
            while now is not None and (after := self._performed(name, now, poses)) != now:
                now = after
            if now is None:
                del named[name]
                resolved = True
            else:
                named[name] = now
        if resolved:
            progress = tuple(
                (next_, 0) if robot.in_order else (0, 0)
                for robot, (next_, _) in zip(self.robots, progress, strict=True)
            )
        met = tuple(
            self._met(robot, pose[0], one)
            for robot, pose, one in zip(self.robots, poses, progress, strict=True)
        )
        return poses, met, tuple(sorted(named.items()))

    def _performed(self, name: str, stage: Stage, poses: tuple[Pose, ...]) -> Stage | None:
        """The stage after what the robots where they stand can do; None: resolved."""
        index, done = stage
        needs = self.mission.obstacles[name].needs
        here = self._able(needs[index], poses) - done
        if needs[index].together and len(here) < needs[index].robots:
            return stage
        done |= here
        if len(done) < needs[index].robots:
            return index, frozenset(done)
        return (index + 1, FIRST[1]) if index + 1 < len(needs) else None

    def _able(self, need: Need, poses: tuple[Pose, ...]) -> frozenset[str]:
        return frozenset(
            robot.name
            for robot, pose in zip(self.robots, poses, strict=True)
            if need.action in robot.capabilities and pose[0] in need.at
        )

    def _met(self, robot: Robot, region: int, progress: Progress) -> Progress:
        next_, count = progress
        most = self.mission.rounds * (len(robot.targets) if robot.in_order else 1)
        if robot.stays:
            last = len(robot.targets) - 1
            while next_ < last and region in robot.targets[next_]:
                next_ += 1
            there = next_ == last and region in robot.targets[last]
            return next_, most if there else count
        while count < most:
            if robot.in_order:
                if region not in robot.targets[next_]:
                    break
                next_, count = (next_ + 1) % len(robot.targets), count + 1
            else:
                covered = next_
                for k, target in enumerate(robot.targets):
                    covered |= (region in target) << k
                if covered == (1 << len(robot.targets)) - 1:
                    next_, count = 0, count + 1
                    continue
                return covered, count
        return next_, count

    def _rounds(self, robot: Robot, progress: Progress) -> int:
        return progress[1] // len(robot.targets) if robot.in_order else progress[1]

    def _distance(self, state: State) -> float:
        """Return an estimate: goals to meet, steps to the next one, remaining obstacles."""
        poses, progress, stages = state
        total = 5.0 * len(stages)
        for k, (robot, (next_, count)) in enumerate(zip(self.robots, progress, strict=True)):
            targets = len(robot.targets)
            if robot.stays:
                left = 0 if count else targets - next_
                total += self.ways[k][next_].get(poses[k], 99)
                ways = []
            elif robot.in_order:
                left = self.mission.rounds * targets - count
                ways = [self.ways[k][next_]]
            else:
                left = (self.mission.rounds - count) * targets - next_.bit_count()
                ways = [way for j, way in enumerate(self.ways[k]) if not next_ >> j & 1]
            total += 8 * left
            if left > 0:
                total += min((way.get(poses[k], 99) for way in ways), default=0)
        return total


# The poses of one robot alone, as sets of bits: reachable ones, and those from which it can
# continue.


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
