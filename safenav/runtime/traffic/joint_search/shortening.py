"""Shortening of joint plans: each robot's path is replanned against the timed paths of the others.

A plan is timed by its own dependency order, one tick per step; no robot enters a region in the tick
in which another one leaves it. Then one robot at a time, the last to arrive first, gets the path
with the fewest steps that arrives by the end of the plan; the robots that arrive last get the
earliest path. Sets of poses are bit masks: a layer of the search (a tick, a number of steps) is a
few shifts.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from itertools import pairwise

from msgspec import Struct

from safenav.runtime.resolution.problem import Separation
from safenav.runtime.traffic.budgets import SHORTENING_LAYERS, SHORTENING_ROUNDS
from safenav.runtime.traffic.joint_search.execution import Execution, Schedule, schedule
from safenav.runtime.traffic.joint_search.states import Course, JointState, has_met
from safenav.world.poses import FAR, Mask, PoseGraph, bits

Timed = Sequence[tuple[int, ...]]
"""The joint poses at each tick, from the first to the last."""


def shortened(
    course: Course,
    states: Sequence[JointState],
    fixed: Collection[int],
    stopping: Callable[[], None] = lambda: None,
) -> Sequence[JointState]:
    """Return a plan of at most as many ticks and steps as ``states``: the same stages are reached,
    or, where these do not change, the same goals counted (rounds restart with a resolution).
    ``fixed``: the robots that must end in the same pose; ``stopping`` may end the run."""
    problem, first, last = course.problem, states[0], states[-1]
    if len(states) < 3:
        return states
    apart = problem.separation
    plan = schedule(apart, [state.poses for state in states])
    joint = timed(plan)
    if last.stages != first.stages:
        fixed = range(len(apart.sizes))
    paths = [
        TimedPath(
            member.graph,
            course.steps(first.stages)[robot].allowed,
            tuple(
                1 << after.poses[robot]
                for before, after in pairwise(states)
                if before.counts[robot] != after.counts[robot] and last.stages == first.stages
            ),
            1 << last.poses[robot] if robot in fixed else member.graph.everywhere,
        )
        for robot, member in enumerate(problem.members)
    ]
    best = _improved(joint, paths, apart, stopping)
    turns = timed(schedule(apart, best), in_turn=True)
    if best is joint or len(turns) > len(timed(plan, in_turn=True)):
        return states
    found = course.along(first, best[1:])
    if last.stages != first.stages:
        # The plan ends with the change; its rest only shows that the team can continue.
        changed = next((k for k, s in enumerate(found) if s.stages != first.stages), 0)
        return found[: changed + 1] if found[changed].stages == last.stages else states
    met = all(map(has_met, found[-1].counts, last.counts))
    return found if met and all(state.stages == last.stages for state in found) else states


def timed(plan: Schedule, *, in_turn: bool = False) -> list[tuple[int, ...]]:
    """Return the joint poses at each tick if each step takes one and begins as soon as the order
    of the plan allows. ``in_turn``: a robot may follow one that is before it in the team in the
    same tick, as in lockstep."""
    run = Execution(plan)
    joint = [tuple(path[0] for path in plan.paths)]
    while not run.finished:
        moving = {}
        for robot in range(len(plan.paths)):
            pose = run.next(robot)
            if pose is not None:
                moving[robot] = pose
                if in_turn:
                    run.arrived(robot)
        assert moving, "the order of a plan has no circle"
        for robot in () if in_turn else moving:
            run.arrived(robot)
        joint.append(tuple(moving.get(robot, pose) for robot, pose in enumerate(joint[-1])))
    return joint


def _improved(
    joint: Timed, paths: Sequence[TimedPath], apart: Separation, stopping: Callable[[], None]
) -> Timed:
    """Return the plan after replanning each robot's path until nothing changes."""
    for _ in range(SHORTENING_ROUNDS):
        before = joint
        arrivals = [arrival_of(joint, robot) for robot in range(len(paths))]
        for robot in sorted(range(len(paths)), key=lambda robot: -arrivals[robot]):
            stopping()
            for path in paths[robot].shorter(joint, robot, apart, arrivals[robot]):
                new = [(*p[:robot], q, *p[robot + 1 :]) for p, q in zip(joint, path, strict=True)]
                found = timed(schedule(apart, new))
                (ticks, steps), (most_ticks, most_steps) = _cost(found), _cost(joint)
                shorter = ticks < most_ticks or steps < most_steps
                if shorter and ticks <= most_ticks and steps <= most_steps:
                    joint = found
                    break
        if joint is before:
            break
    return joint


def _cost(joint: Timed) -> tuple[int, int]:
    """Return the ticks and steps of a plan."""
    return len(joint), sum(a != b for x, y in pairwise(joint) for a, b in zip(x, y, strict=True))


def arrival_of(joint: Timed, robot: int) -> int:
    """Return the tick in which a robot takes its last step; 0 if it stays."""
    ticks = range(1, len(joint))
    return max((t for t in ticks if joint[t][robot] != joint[t - 1][robot]), default=0)


def closed_by(joint: Timed, robot: int, apart: Separation, graph: PoseGraph) -> list[Mask]:
    """Return the poses that other robots close in each tick: theirs before and after it."""
    return [graph.poses_on(apart.closed(robot, *ends)) for ends in pairwise(joint)]


class TimedPath(Struct, frozen=True):
    """Requirements on a robot's path: poses ``allowed``, sets of poses in the order in which it
    must pass them (``via``), and those in which it may end (``final``)."""

    graph: PoseGraph
    allowed: Mask
    via: tuple[Mask, ...]
    final: Mask

    def shorter(
        self, joint: Timed, robot: int, apart: Separation, arrival: int
    ) -> Iterator[list[int]]:
        """Yield the path with the fewest steps among those that end in time, then, for a robot that
        arrives among the last, the earliest path. One pose per tick."""
        start, steps, ticks = (
            joint[0][robot],
            _cost([(p[robot],) for p in joint])[1],
            len(joint) - 1,
        )
        least = self._least(start)
        fewer, earlier = steps > least, arrival == ticks > least
        if not (fewer or earlier):
            return
        closed = closed_by(joint, robot, apart, self.graph)
        later = self.graph.poses_on(apart.closed(robot, joint[-1]))
        ends = [self.final & ~later]
        for poses in reversed(closed):
            later |= poses
            ends.insert(0, self.final & ~later)
        path = self.find(start, closed, ends, steps - 1, early=False) if fewer else None
        if path is not None:
            yield path
        path = self.find(start, closed, ends[:-1], steps, early=True) if earlier else None
        if path is not None:
            yield [*path, path[-1]]

    def _least(self, start: int) -> int:
        """Return the steps of the shortest path without other robots; 0 if the robot may stay."""
        found = 0
        for goal in (*self.via, self.final):
            found += self.graph.distances(goal, self.allowed)[start]
            start = goal.bit_length() - 1
        return found

    def find(
        self, start: int, closed: Sequence[Mask], ends: Sequence[Mask], most: int, early: bool
    ) -> list[int] | None:
        """Return a path of at most ``most`` steps, one pose per tick: the earliest, else the one
        with the fewest steps; None if there is none, or the budget is exhausted. ``closed``: poses
        that others close in each tick; ``ends``: those where it may end at each tick."""
        forward, goals = self.graph.forward, len(self.via)
        rows: list[list[_Cell]] = []  # by number of steps, then by tick
        known = [[0] * (goals + 1) for _ in ends]
        last, found, layers = len(ends) - 1, None, 0
        for count in range(most + 1):
            row: list[_Cell] = []
            for tick in range(last + 1):
                cell = [0] * (goals + 1)
                if tick == 0:
                    cell[0] = 1 << start if count == 0 else 0
                elif free := ~closed[tick - 1]:
                    cell = [poses & free for poses in row[-1]]
                    if count:
                        for k, poses in enumerate(rows[-1][tick - 1]):
                            if poses:
                                cell[k] |= forward(poses & free) & self.allowed & free
                self._pass(cell)
                for k, poses in enumerate(known[tick]):
                    cell[k] &= ~poses
                    known[tick][k] |= cell[k]
                row.append(cell)
                if cell[goals] & ends[tick]:
                    found, last = (count, tick), tick - 1
                    break
            rows.append(row)
            layers += len(row)
            if found is not None and not early:
                break
            if layers > SHORTENING_LAYERS or not any(map(any, row)):
                break
        if found is None:
            return None
        count, tick = found
        pose = next(bits(rows[count][tick][goals] & ends[tick]))
        path = [pose] * (len(ends) - tick)
        k = goals
        while tick:
            tick -= 1
            count, k, pose = self._before(rows, count, tick, k, pose, closed[tick])
            path.append(pose)
        return path[::-1]

    def _pass(self, cell: _Cell) -> None:
        """Advance the count of sets that a robot passes in its poses."""
        for k, via in enumerate(self.via):
            met = cell[k] & via
            cell[k] ^= met
            cell[k + 1] |= met

    def _before(
        self,
        rows: Sequence[Sequence[_Cell]],
        count: int,
        tick: int,
        k: int,
        pose: int,
        closed: Mask,
    ) -> tuple[int, int, int]:
        """Return the steps, sets passed and pose one tick before a robot is in a cell."""
        for passed in range(k, -1, -1):
            if rows[count][tick][passed] & 1 << pose:
                return count, passed, pose
            if count:
                came = self.graph.backward(1 << pose) & rows[count - 1][tick][passed] & ~closed
                if came:
                    return count - 1, passed, next(bits(came))
            if not passed or not self.via[passed - 1] >> pose & 1:
                break
        raise AssertionError("each cell was reached from another one")


_Cell = list[int]
"""The poses in which a robot may be, indexed by the number of ``via`` sets passed."""


def following(course: Course, states: Sequence[JointState], robot: int) -> list[JointState] | None:
    """Return a plan of the same ticks in which a robot, after completing its path, approaches its
    next target as far as possible; None if it cannot get nearer, or the plan would change
    otherwise.

    A plan ends when an obstacle is resolved. By then a robot that waits for the resolution, and has
    completed its path, may stand behind the helper instead of where it let the helper pass.
    """
    problem, first, last = course.problem, states[0], states[-1]
    apart = problem.separation
    graph = problem.members[robot].graph
    joint = timed(schedule(apart, [s.poses for s in states]))
    goal = course.awaited(robot, last.counts[robot])
    far = graph.distances(goal, problem.allowed(robot, last.stages))
    begin = arrival_of(joint, robot)
    here, allowed = joint[begin][robot], course.steps(first.stages)[robot].allowed
    closed = closed_by(joint[begin:], robot, apart, graph)
    reached = 1 << here
    for poses in closed:
        free = reached & ~poses
        reached = free | graph.forward(free) & allowed & ~poses
    pose = min(bits(reached), key=far.__getitem__, default=here)
    if not far[pose] < min(far[here], FAR):
        return None
    path = TimedPath(graph, allowed, (), 1 << pose)
    way = path.find(here, closed, [0] * len(closed) + [1 << pose], len(closed), early=False)
    if way is None:
        return None
    steps = (poses[robot] if t <= begin else way[t - begin] for t, poses in enumerate(joint))
    pairs = zip(joint, steps, strict=True)
    new = [(*poses[:robot], step, *poses[robot + 1 :]) for poses, step in pairs]
    found = course.along(first, new[1:])
    same = all(state.stages == first.stages for state in found[:-1])
    return found if same and found[-1].stages == last.stages else None
