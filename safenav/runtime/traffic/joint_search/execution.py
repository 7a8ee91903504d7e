"""A joint plan in execution: which robot must have left before another may enter.

A plan is kept as the path of each robot, and as an order between the robots: a step into a region
waits until the robots that were there before have arrived elsewhere (an action dependency graph;
Hoenig et al.: Persistent and robust execution of MAPF schedules in warehouses, RA-L 2019). So
delays cannot invalidate it, and every execution is a prefix of an order of the plan.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from functools import reduce
from itertools import chain, pairwise
from operator import or_

from msgspec import Struct
from msgspec.structs import replace

from safenav.begun import PlanLeft
from safenav.components import explored
from safenav.runtime.resolution.problem import Floor, Problem, Separation
from safenav.runtime.traffic.joint_search.states import Count, JointState
from safenav.trace import records
from safenav.world.moves import Pose
from safenav.world.poses import Mask, bits, region_mask

Paths = tuple[tuple[int, ...], ...]
"""The poses of each robot in order, from its present one."""


class Order(Struct, frozen=True):
    """``robot`` takes its step ``step`` only after ``other`` has taken its step ``before``. Step k
    leads from pose k to pose k + 1 of a robot's path."""

    robot: int
    step: int
    other: int
    before: int


class Schedule(Struct, frozen=True):
    """The paths of a plan and the order between them."""

    paths: Paths
    orders: tuple[Order, ...]


def schedule(
    apart: Separation, states: Sequence[tuple[int, ...]], under_way: Collection[int] = ()
) -> Schedule:
    """Return the schedule of a sequence of joint poses. ``under_way``: robots whose first step
    has begun, and so waits for no other robot."""
    paths = [[pose] for pose in states[0]]
    present = [[i, -1] for i in range(len(paths))]  # a robot, and its step out of a region
    stays: dict[int, list[list[int]]] = defaultdict(list)
    for stay, pose, size in zip(present, states[0], apart.sizes, strict=True):
        stays[pose % size].append(stay)
    orders: list[Order] = []
    for joint in states[1:]:
        moving = [i for i, path in enumerate(paths) if joint[i] != path[-1]]
        for i in moving:  # every robot leaves before any enters: the order within a step
            present[i][1] = len(paths[i]) - 1
        for i in moving:
            step, region = len(paths[i]) - 1, joint[i] % apart.sizes[i]
            latest = {r: left for r, left in stays[region] if r in apart.conflicts[i]}
            for robots, zone in apart.zones:
                if i in robots and zone >> region & 1:
                    for robot, left in chain(*(stays[r] for r in bits(zone))):
                        if robot in robots and robot != i:
                            latest[robot] = max(left, latest.get(robot, left))
            if step or i not in under_way:
                orders += [Order(i, step, robot, left) for robot, left in latest.items()]
            paths[i].append(joint[i])
            present[i] = [i, -1]
            stays[region].append(present[i])
    return Schedule(tuple(map(tuple, paths)), tuple(orders))


def required_counts(
    states: Sequence[JointState], counts: Sequence[Count]
) -> list[dict[int, Count]]:
    """Return for each robot the count that it must have before it leaves a place of its path: the
    plan assumes that it has met these goals there, by waiting. ``states``: the states of the plan;
    ``counts``: the counts at its start, which may be less than in the first state."""
    dues: list[dict[int, Count]] = [
        {} if first == count else {0: first}
        for first, count in zip(states[0].counts, counts, strict=True)
    ]
    steps = [0] * len(dues)
    for before, after in pairwise(states):
        for robot, due in enumerate(dues):
            if after.poses[robot] != before.poses[robot]:
                steps[robot] += 1
            if after.counts[robot] != before.counts[robot]:
                due[steps[robot]] = after.counts[robot]
    return dues


class Execution:
    """Progress of each robot on its path. ``taken``: steps that it has completed; ``dues``: by
    robot and place, see ``required_counts``."""

    def __init__(self, schedule: Schedule, dues: Sequence[Mapping[int, Count]] = ()) -> None:
        self.schedule = schedule
        self.dues = dues
        self.taken = [0] * len(schedule.paths)
        self._ahead: dict[int, Mask] = {}
        self._waits: dict[tuple[int, int], list[Order]] = {}
        for order in schedule.orders:
            self._waits.setdefault((order.robot, order.step), []).append(order)

    @property
    def finished(self) -> bool:
        """Whether every robot is at the end of its path."""
        return all(map(self.done, range(len(self.taken))))

    def done(self, robot: int) -> bool:
        """Whether a robot is at the end of its path."""
        return self.taken[robot] == len(self.schedule.paths[robot]) - 1

    def remaining(self, robot: int) -> tuple[tuple[int, ...], int | None]:
        """Return the rest of a robot's path, and its next target at the end (None: its present
        one)."""
        dues = self.dues[robot] if self.dues else {}
        turn = dues[max(dues)][0] if dues else None
        return self.schedule.paths[robot][self.taken[robot] :], turn

    def ahead(self, robot: int, size: int) -> Mask:
        """Return the remaining regions of a robot's path, from its present one; empty at the end.
        ``size``: number of regions of the map."""
        if robot not in self._ahead:
            path = self.schedule.paths[robot][self.taken[robot] :]
            self._ahead[robot] = region_mask(p % size for p in path) if len(path) > 1 else 0
        return self._ahead[robot]

    def next(self, robot: int) -> int | None:
        """Return the pose to which a robot may step now; None if it is done or must wait."""
        step = self.taken[robot]
        path = self.schedule.paths[robot]
        if step == len(path) - 1:
            return None
        for order in self._waits.get((robot, step), ()):
            if self.taken[order.other] <= order.before:
                return None
        return path[step + 1]

    def due(self, robot: int) -> Count | None:
        """Return the count that a robot must have before it takes its next step."""
        return self.dues[robot].get(self.taken[robot]) if self.dues else None

    def arrived(self, robot: int) -> None:
        """Record that a robot has taken its next step."""
        self.taken[robot] += 1
        self._ahead.pop(robot, None)


def in_turn(schedule: Schedule) -> list[tuple[int, ...]] | None:
    """Return the joint poses of a plan if its steps are taken one by one, as early as their order
    allows; None if some step never can be."""
    trial, found = Execution(schedule), [tuple(path[0] for path in schedule.paths)]
    while not trial.finished:
        robots = range(len(schedule.paths))
        ready = next(((i, pose) for i in robots if (pose := trial.next(i)) is not None), None)
        if ready is None:
            return None
        robot, pose = ready
        trial.arrived(robot)
        found.append((*found[-1][:robot], pose, *found[-1][robot + 1 :]))
    return found


def still(waits: Mapping[str, Collection[str]], busy: Collection[str]) -> set[str]:
    """Return the robots that wait only for waiting robots: no chain of waits leads from them to a
    ``busy`` robot. ``waits``: the adjacent robots in conflict with each robot."""
    moving = explored(busy, lambda name: [n for n, others in waits.items() if name in others])
    return waits.keys() - moving.keys()


def still_needed(problem: Problem, plan: Execution, robot: int) -> Mask:
    """Return the regions that the others need for the rest of a plan, which are closed to a robot
    that has completed its own path. If it enters none of them, and can return without entering
    them, the rest of the plan stays valid (docs/coordination.md, A live run)."""
    size = problem.members[robot].graph.size
    found = reduce(or_, (plan.ahead(other, size) for other in problem.conflicts[robot]), 0)
    for robots, zone in problem.zones:
        others = robots - {robot}
        if robot in robots and any(zone & plan.ahead(i, size) for i in others):
            found |= zone
    return found


def with_steps_under_way(
    poses: Sequence[tuple[int, ...]],
    states: Sequence[JointState],
    counts: Sequence[Count],
    under_way: Mapping[int, int],
) -> tuple[list[tuple[int, ...]], list[JointState]]:
    """Return the joint poses and states of a plan that begins while robots are in transit: the path
    of such a robot starts at its departure pose (``under_way``), and its first step is the present
    one."""
    if not under_way:
        return list(poses), list(states)

    def before(joint: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(under_way.get(robot, pose) for robot, pose in enumerate(joint))

    first = replace(states[0], poses=before(states[0].poses), counts=tuple(counts))
    return [before(poses[0]), *poses], [first, *states]


def plan_record(tick: int, floor: Floor, plan: Schedule, reason: str) -> records.Plan:
    """Return the record of a plan in a trace."""
    robots = {}
    for index, (name, path) in enumerate(zip(floor.names, plan.paths, strict=True)):
        graph = floor.problem.members[index].graph
        robots[name] = tuple(graph.pose(number).place for number in path)
    names = floor.names
    orders = tuple(
        # Step k leads from place k to place k + 1.
        (names[order.other], order.before + 1, names[order.robot], order.step + 1)
        for order in plan.orders
    )
    return records.Plan(tick, reason, robots, orders)


def scheduled(floor: Floor, left: PlanLeft) -> Schedule | None:
    """Return the plan of a trace header; None if it does not fit this team."""
    if left.robots.keys() != {*floor.names}:
        return None
    paths = tuple(
        tuple(member.graph.number(Pose.of(*place)) for place in left.robots[name])
        for name, member in zip(floor.names, floor.problem.members, strict=True)
    )
    orders = tuple(
        Order(floor.index(then), j - 1, floor.index(first), i - 1)
        for first, i, then, j in left.orders
    )
    return Schedule(paths, orders)
