"""Exhaustive search for whether a team can complete a mission, nearest states first."""

import heapq
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

from campaigns.judge.mission import FIRST, NO_HEADING, Mission, Obstacle, Pose, Robot, Stage


class Poses:
    """The poses of one robot alone on the free map: ``after`` and ``before`` one step."""

    def __init__(self, mission: Mission, robot: Robot) -> None:
        self.robot = robot
        headings = range(4) if robot.has_heading else [NO_HEADING]
        poses = product(mission.free - robot.forbidden, headings)
        self.after = {pose: mission.steps(robot, pose) for pose in poses}
        self.before: dict[Pose, list[Pose]] = {pose: [] for pose in self.after}
        for pose, reached in self.after.items():
            for to in reached:
                self.before[to].append(pose)
        self._live: dict[frozenset[int], set[Pose]] = {}

    def live(self, walls: frozenset[int]) -> set[Pose]:
        """The greatest set of poses from which every target (the last one if the robot stays there)
        can be reached within the set."""
        if walls not in self._live:
            inside, old = {pose for pose in self.after if pose[0] not in walls}, set[Pose]()
            while inside != old:
                old = inside
                for target in self.robot.targets[-1 if self.robot.stays else 0 :]:
                    inside = {*spread(self.before, at(target, inside), inside)}
            self._live[walls] = inside
        return self._live[walls]

    def distances(self, target: frozenset[int]) -> dict[Pose, int]:
        """Return the number of steps to the target from each pose, without obstacles."""
        return spread(self.before, at(target, self.before), self.before)


def at(regions: Collection[int], poses: Iterable[Pose]) -> list[Pose]:
    return [pose for pose in poses if pose[0] in regions]


def spread(
    edges: Mapping[Pose, Iterable[Pose]], start: Iterable[Pose], inside: Collection[Pose]
) -> dict[Pose, int]:
    """Return the poses that edges reach within a set, each with the number of steps."""
    found = dict.fromkeys(start, 0)
    queue = [*found]
    for pose in queue:
        for to in edges[pose]:
            if to in inside and to not in found:
                found[to] = found[pose] + 1
                queue.append(to)
    return found


# Situations of a mission, and the search from one.


Progress = tuple[int, int]
"""A robot's next target (not ``in_order``: the targets covered, bit by bit), and the goals (or
rounds) that it has met since the last resolution."""


@dataclass(frozen=True)
class Situation:
    """A moment of a mission. ``stages``: the obstacles that are known and unresolved; those not
    listed are absent. ``sealed``: those found to be permanent. ``came``: the regions from which
    robots came: they leave an unresolved obstacle nowhere else."""

    poses: Mapping[str, Pose]
    progress: Mapping[str, Progress]
    stages: Mapping[str, Stage]
    sealed: Collection[str] = ()
    came: Mapping[str, int] = field(default_factory=dict)


def at_start(mission: Mission, known: Iterable[str] = ()) -> Situation:
    """Return the situation before the first move: obstacles that are not known count as absent."""
    poses = {name: robot.start for name, robot in mission.robots.items()}
    return Situation(poses, dict.fromkeys(poses, (0, 0)), dict.fromkeys(known, FIRST))


Stages = tuple[tuple[str, Stage], ...]
State = tuple[tuple[Pose, ...], tuple[Progress, ...], Stages]


def can_complete(mission: Mission, begin: Situation, budget: int = 200_000) -> bool | None:
    """Return whether the team can complete the mission: ``is_complete`` for one of the states,
    nearest first; False: of all states that can be reached, None: of more than ``budget``."""
    search = Search(mission, begin)
    queue: list[tuple[float, int, State]] = []
    seen: set[State] = set()
    states: Iterable[State] = search.starts()
    while True:
        for state in states:
            if state not in seen:
                if len(seen) >= budget:
                    return None
                seen.add(state)
                heapq.heappush(queue, (search.distance(state), len(seen), state))
        if not queue:
            return False
        _, _, state = heapq.heappop(queue)
        if search.is_complete(state):
            return True
        states = search.successors(state)


class Search:
    """The states of a mission from some situation on: the pose and progress of each robot and the
    stage of each obstacle. One robot moves at a time, into a region without a robot in conflict
    with it. Robots perform actions wherever they can."""

    def __init__(self, mission: Mission, begin: Situation) -> None:
        self.mission, self.begin = mission, begin
        self.robots, names = [*mission.robots.values()], [*mission.robots]
        self.rivals = [[names.index(other) for other in mission.conflicts[name]] for name in names]
        self.graphs = [Poses(mission, robot) for robot in self.robots]
        self.ways = [[each.distances(t) for t in each.robot.targets] for each in self.graphs]
        self._closed_at: dict[Stages, list[frozenset[int]]] = {}
        needs = (need for one in mission.obstacles.values() for need in one.needs)
        self._sites = frozenset[int]().union(*(need.at for need in needs))

    def starts(self) -> Iterator[State]:
        """The state itself, and where a patrol has met nothing yet, its other order, too."""
        choices = []
        for robot in self.robots:
            first = self.begin.progress[robot.name]
            free = robot.either_first and robot.in_order and first == (0, 0)
            choices.append([(k, 0) for k in range(len(robot.targets))] if free else [first])
        poses = tuple(self.begin.poses[robot.name] for robot in self.robots)
        stages = tuple(sorted(self.begin.stages.items()))
        return (self._settled((poses, progress, stages)) for progress in product(*choices))

    def successors(self, state: State) -> Iterator[State]:
        poses, progress, stages = state
        closed = self._closed(stages)
        for k, robot in enumerate(self.robots):
            taken = {poses[other][0] for other in self.rivals[k]}
            inside = poses[k][0] in closed[k] and poses[k] == self.begin.poses[robot.name]
            back = self.begin.came.get(robot.name) if inside else None
            for pose in self.mission.steps(robot, poses[k]):
                if pose[0] not in taken | closed[k] and back in (None, pose[0]):
                    after = (*poses[:k], pose, *poses[k + 1 :])
                    yield self._settled((after, progress, stages), k)

    def is_complete(self, state: State) -> bool:
        """Whether all robots have met their objectives ``rounds`` times since the last resolution,
        those that stay at their last target are there, and each could continue by itself."""
        poses, progress, stages = state
        closed = self._closed(stages)
        return all(
            progress[k][1] >= self._most(robot)
            and (not robot.stays or poses[k][0] in robot.targets[-1])
            and poses[k] in self.graphs[k].live(closed[k])
            for k, robot in enumerate(self.robots)
        )

    def _most(self, robot: Robot) -> int:
        """The count of a robot that has met its objective."""
        return int(self.mission.rounds) * (len(robot.targets) if robot.in_order else 1)

    def _closed(self, stages: Stages) -> list[frozenset[int]]:
        """The regions that obstacles close to each robot."""

        def closes(obstacle: Obstacle, name: str) -> bool:
            if obstacle.name in self.begin.sealed:
                return name in obstacle.blocks
            stage = named.get(obstacle.name)
            return stage is not None and self.mission.blocked(name, obstacle, stage)

        if stages not in self._closed_at:
            named, all_ = dict(stages), self.mission.obstacles.values()
            self._closed_at[stages] = [
                frozenset(one.region for one in all_ if closes(one, robot.name))
                for robot in self.robots
            ]
        return self._closed_at[stages]

    def _settled(self, state: State, moved: int | None = None) -> State:
        """Return a state after all that robots do at their poses: actions, then goals. ``moved``:
        the only robot that has done neither where it is."""
        poses, progress, stages = state
        if moved is not None and poses[moved][0] not in self._sites:
            own = self._met(self.robots[moved], poses[moved][0], progress[moved])
            return poses, (*progress[:moved], own, *progress[moved + 1 :]), stages
        named, where = dict(stages), {r.name: p[0] for r, p in zip(self.robots, poses, strict=True)}
        for name, stage in stages:
            obstacle = self.mission.obstacles[name]
            named[name] = self.mission.performed(obstacle, stage, where, where)
            if named[name][0] == len(obstacle.needs):
                del named[name]
        if len(named) < len(stages):
            both = zip(self.robots, progress, strict=True)
            progress = tuple((next_ * robot.in_order, 0) for robot, (next_, _) in both)
        met = tuple(map(self._met, self.robots, where.values(), progress))
        return poses, met, tuple(sorted(named.items()))

    def _met(self, robot: Robot, region: int, progress: Progress) -> Progress:
        (next_, count), most, many = progress, self._most(robot), len(robot.targets)
        if robot.stays:
            while next_ < many - 1 and region in robot.targets[next_]:
                next_ += 1
            there = next_ == many - 1 and region in robot.targets[next_]
            return next_, most if there else count
        while count < most:
            if robot.in_order:
                if region not in robot.targets[next_]:
                    break
                next_, count = (next_ + 1) % many, count + 1
            else:
                next_ |= sum((region in target) << k for k, target in enumerate(robot.targets))
                if next_ < (1 << many) - 1:
                    break
                next_, count = 0, count + 1
        return next_, count

    def distance(self, state: State) -> float:
        """Return an estimate: goals to meet, steps to the next one, remaining obstacles."""
        poses, progress, stages = state
        total = 5.0 * len(stages)
        for k, (robot, (next_, count)) in enumerate(zip(self.robots, progress, strict=True)):
            many, ways = len(robot.targets), self.ways[k]
            if robot.stays:
                left, ways = 0 if count else many - next_, [ways[next_]]
            elif robot.in_order:
                left, ways = self._most(robot) - count, [ways[next_]]
            else:
                left = (self._most(robot) - count) * many - next_.bit_count()
                ways = [way for j, way in enumerate(ways) if not next_ >> j & 1]
            total += 8 * left
            if left > 0 or robot.stays:
                total += min((way.get(poses[k], 99) for way in ways), default=0)
        return total
