"""Best and worst times from the request for an obstacle to its resolution, computed before any run.

They cover all poses of a requester beside the obstacle, and all poses that the helpers' own
strategies visit: once with this obstacle alone, once with all others present and known (the worst
case). In the best case steps are fast, and some needs were fulfilled before the request; in the
worst case steps are slow, and have just begun. The times are the lower bounds of ``bound``: for one
obstacle that one robot resolves they are exact except for collisions.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import product
from math import prod

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.deadlines import bound
from safenav.runtime.formulas import graph_of, permitted
from safenav.runtime.navigation import pose_of
from safenav.runtime.resolution.problem import OpenObstacle, Stage
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.world.map import Region
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import FAR, bits, plain_graph

MOST_MOMENTS = 2_000
"""Most moments of one obstacle that are compared; beyond that the helpers are examined one by
one."""
WORK, ALL_WORK = 3_000, 50_000
"""Work of one comparison, and of all together, in bounds for one robot and one obstacle of a moment
(20 to 70 microseconds each); further moments are left out, and reported so. Counted, not timed, so
that a busy machine finds the same."""


class Times(Struct, frozen=True):
    """Ticks from the tick of the request to that of the resolution, at ``best`` and at ``worst``
    (None: never). ``moment``: the poses in the worst case, the requester first; ``bids``: the ticks
    that each robot with the first action needs from there (None: no path), which may include the
    tick of the request. ``whole``: all states were compared; ``nearest``: the robots with the
    lowest bids help, even if they cannot return."""

    best: int | None
    worst: int | None
    moment: Mapping[str, Pose]
    bids: Mapping[str, int | None]
    whole: bool
    nearest: bool = True


class Worst(Struct, frozen=True):
    """The times of an obstacle, alone and with all ``others`` present (None: there are none)."""

    obstacle: Obstacle
    limit: int | None
    alone: Times
    surrounded: Times | None


def visited(task: Task, strategy: object, scenario: Scenario) -> list[Pose]:
    """Return the poses that a strategy visits; without an explicit strategy, all that its robot can
    reach."""
    if isinstance(strategy, Strategy):
        found = {pose_of(strategy.values(node)) for node in range(len(strategy.states))}
        return sorted(found, key=lambda pose: (pose.region, pose.heading or 0))
    graph = plain_graph(scenario.map, task.robot.model.mobility)
    allowed = graph.outside(known.region for known in task.blocked)
    reached = graph.closure(1 << graph.number(task.pose), allowed)
    return [graph.pose(number) for number in bits(reached)]


def worst_cases(
    scenario: Scenario, poses: Mapping[str, Sequence[Pose]], never: Collection[str] = ()
) -> list[Worst]:
    """Return the times of each listed or suspected obstacle that some robot can encounter from its
    ``poses``. ``never``: obstacles known to remain unresolved, although the bounds may not show
    it."""
    listed = (*(scenario.suspects or ()), *scenario.obstacles)  # if both: with its deadline
    known = list({o.name: o for o in listed if o.appears is None and o.goes is None}.values())
    found, work = [], min(WORK, ALL_WORK // (2 * max(1, len(known))))
    for obstacle in known:
        alone = _Case(scenario, poses, obstacle, [obstacle]).times(work)
        if alone is None:
            continue
        if obstacle.name in never:
            alone = replace(alone, best=None, worst=None, whole=True)
            found.append(Worst(obstacle, scenario.limit_of(obstacle), alone, None))
            continue
        rest = [other for other in known if other is not obstacle]
        case = _Case(scenario, poses, obstacle, [obstacle, *rest])
        around = case.times(work) if rest else None
        found.append(Worst(obstacle, scenario.limit_of(obstacle), alone, around))
    return found


class _Case(Struct, frozen=True, dict=True):
    """A request for an obstacle among those that are ``standing``; ``poses`` of each robot."""

    scenario: Scenario
    poses: Mapping[str, Sequence[Pose]]
    obstacle: Obstacle
    standing: Sequence[Obstacle]

    @cached_property
    def opens(self) -> tuple[bound.BoundObstacle, ...]:
        """The obstacles in the model of the bounds, the requested one first."""
        scenario, by = self.scenario, self.scenario.until.by
        return tuple(
            bound.BoundObstacle(
                OpenObstacle.of(each, scenario.robots, scenario.map),
                sequential=by is None and scenario.limit_of(each) is None,
            )
            for each in self.standing
        )

    def times(self, work: int) -> Times | None:
        """Return the times of the obstacle; None if no robot that it blocks can encounter it.
        ``work``: its limit; one moment is always examined."""
        poses, robots, opens = self.poses, self.scenario.robots, self.opens
        closed = {other.region for other in self.standing}
        skills = [each for one in opens for each in one.gate.skills]
        pools = {
            robot.name: [p for p in poses[robot.name] if p.region not in closed] or [robot.start]
            for robot in robots
            if any(each <= robot.capabilities for each in skills)
        }
        steady = all(robot.model.timing.most == 1 for robot in robots)
        moving = {name for name, places in poses.items() if len(places) > 1}
        requesters, cost = [*self._requesters(closed)], len(robots) * len(opens)
        if not requesters:
            return None
        far: dict[str, Pose] = {}
        best: int | None = None
        worst: int | None = -1
        moment: Mapping[str, Pose] = {}
        whole = True
        for index, pose in requesters:
            name = robots[index].name
            others = {other: places for other, places in pools.items() if other != name}
            every_moment = prod(map(len, others.values())) <= MOST_MOMENTS
            whole = whole and every_moment
            far = far if every_moment or far else self._farthest(pools)
            every = (dict(zip(others, each, strict=True)) for each in product(*others.values()))
            for places in every if every_moment else _one_by_one(others, far):
                if moment and work <= 0:
                    whole = False
                    break
                work -= cost
                at = {name: pose, **places}
                ticks = self._resolved_after(at, opens, index, slow=moving)
                for begun in self._begun(index):
                    same = steady and begun == opens
                    work -= 0 if same else cost
                    soon = ticks if same else self._resolved_after(at, begun, index)
                    best = soon if best is None or (soon is not None and soon < best) else best
                if worst is not None and (ticks is None or ticks > worst):
                    worst, moment = ticks, at
        return Times(best, worst, moment, self._bids(moment), whole, self._nearest_help())

    def _nearest_help(self) -> bool:
        """Return whether the bids alone decide which robots help. Without a deadline, coordination
        may prefer a farther robot to one that could not turn back after helping."""
        for one in self.opens if self.opens[0].sequential else ():
            for need, skills in zip(one.gate.needs, one.gate.skills, strict=True):
                able = [robot for robot in self.scenario.robots if skills <= robot.capabilities]
                turning = any(robot.model.mobility is Mobility.HEADING for robot in able)
                if turning and len(able) > need.robots:
                    return False
        return True

    def _begun(self, requester: int) -> Iterator[tuple[bound.BoundObstacle, ...]]:
        """Yield the possible states of the obstacles when the first one is requested: robots may
        have met some of its needs in passing, but take no load before the request."""
        first, *rest = self.opens
        for number, need in enumerate(first.gate.needs):
            if not need.same and requester in first.gate.closed_to[number]:
                yield replace(first, stage=Stage(number)), *rest
            passing = [
                robot.name
                for robot in self.scenario.robots
                if first.gate.skills[number] <= robot.capabilities
                and any(need.regions >> pose.region & 1 for pose in self.poses[robot.name])
            ]
            if len(passing) < need.robots:
                return

    def _requesters(self, closed: Collection[Region]) -> Iterator[tuple[int, Pose]]:
        """Yield the robots that must keep out of the obstacle, by number, in each pose beside
        it."""
        for index, robot in enumerate(self.scenario.robots):
            graph = graph_of(robot, self.scenario.map)
            for pose in self.poses[robot.name] if self.obstacle.closed_to(robot) else ():
                steps = graph.steps(graph.number(pose))
                beside = any(step % graph.size == self.obstacle.region for step in steps)
                if beside and pose.region not in closed:
                    yield index, pose

    def _bids(self, at: Mapping[str, Pose]) -> dict[str, int | None]:
        """Return the bids of a request: the ticks, at its slowest step, that each robot needs to
        reach a region of the obstacle's first action around all obstacles that block it."""
        skills, found = self.obstacle.type.actions(0), dict[str, int | None]()
        for robot in self.scenario.robots:
            if robot.name in at and skills <= robot.capabilities:
                steps = self._distance(robot)(at[robot.name])
                found[robot.name] = None if steps >= FAR else steps * robot.model.timing.most
        return found

    def _distance(self, robot: Robot) -> Callable[[Pose], int]:
        """Return the distance in steps of each pose of a robot to the regions of the first action;
        FAR without a path."""
        graph = graph_of(robot, self.scenario.map)
        closed = graph.on(other.region for other in self.standing if other.closed_to(robot))
        allowed = permitted(robot, graph) & ~closed
        goal = graph.on(self.obstacle.resolution_regions(self.scenario.map)) & allowed
        steps = graph.distances(goal, allowed)
        return lambda pose: steps[graph.number(pose)]

    def _farthest(self, pools: Mapping[str, Sequence[Pose]]) -> dict[str, Pose]:
        """Return the pose of each helper that is farthest from the regions of the first action."""
        found = {name: self._distance(self.scenario.robot(name)) for name in pools}
        return {name: max(places, key=found[name]) for name, places in pools.items()}

    def _resolved_after(
        self,
        at: Mapping[str, Pose],
        opens: tuple[bound.BoundObstacle, ...],
        requester: int,
        *,
        slow: Collection[str] | None = None,
    ) -> int | None:
        """Return the ticks from a request in tick 1 to the first tick in which it can be resolved.
        ``slow``: steps take their maximum, and these robots, except the requester, have just begun
        one."""
        walkers = []
        for index, robot in enumerate(self.scenario.robots):
            graph = graph_of(robot, self.scenario.map)
            number = graph.number(at.get(robot.name, robot.start))
            skills = robot.capabilities if robot.name in at else frozenset[str]()
            ready, timing = 1 if index <= requester else 0, robot.model.timing
            if slow is not None and robot.name in slow and index != requester:
                ready += timing.most - 1
            ticks = timing.least if slow is None else timing.most
            closed = graph.everywhere & ~permitted(robot, graph)
            walkers.append(bound.BoundRobot(graph, number, ready, ticks, skills, closed))
        moment = bound.BoundMoment(tuple(walkers), opens, len(walkers) + requester)
        tick = bound.tick_of(bound.earliest(moment)[0][-1], moment.count)
        return None if tick is None else tick - 1


def _one_by_one(
    pools: Mapping[str, Sequence[Pose]], fixed: Mapping[str, Pose]
) -> Iterator[dict[str, Pose]]:
    """Yield the ``fixed`` poses of all helpers, then each pose of each helper with the others
    fixed."""
    here = {name: fixed[name] for name in pools}
    yield here
    for name, places in pools.items():
        for place in places:
            yield {**here, name: place}
