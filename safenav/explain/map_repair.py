"""Repairs of the map: an obstacle that a robot can resolve instead of a wall, or no wall.

Walls are tried in the order of the shortest path through them; where one is not enough, the path
through the fewest."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from safenav.explain.explanation import Repair, RepairKind, RepairProblem
from safenav.scenario.model import Obstacle, ObstacleType, Robot, Scenario
from safenav.scenario.reachability import Reachability
from safenav.scenario.yaml.document import flow
from safenav.spec.task import Task
from safenav.world.map import Heading, Region, RegionMap


def open_walls(problem: RepairProblem) -> Iterator[Repair]:
    """Yield scenarios with an obstacle instead of a wall, and the robots that can resolve it."""
    scenario = problem.scenario
    for wall in _single_walls(problem):
        opened = without_walls(scenario, [wall])
        for obstacle, helpers in _resolvable(wall, opened.map, scenario, problem.robot):
            truth = {"traversable": obstacle.traversable}
            written = flow({"type": obstacle.type.name, "region": wall, **truth})
            yield Repair(
                RepairKind.OPEN_WALL,
                (*without_words([wall]), ("obstacles", written)),
                replace(opened, obstacles=(*scenario.obstacles, obstacle)),
                helpers,
                obstacle.type.action,
            )


def removed_walls(problem: RepairProblem) -> Iterator[Repair]:
    """Yield scenarios without one wall, or without the fewest that are in the way."""
    scenario, lost = problem.scenario, problem.diagnosis.lost
    ways = [[wall] for wall in _single_walls(problem)]
    fewest = (_fewest_walls(scenario.map, problem.task, target) for target in lost)
    for way in (*ways, *(way for way in fewest if len(way) > 1)):
        yield Repair(RepairKind.REMOVE_WALLS, without_words(way), without_walls(scenario, way))


def _single_walls(problem: RepairProblem) -> list[Region]:
    """Return the walls between a reachable region and another one, ordered by the length of the
    path across them to the targets."""
    world, task, found = problem.scenario.map, problem.task, problem.diagnosis
    targets = found.lost or task.targets
    from_start = world.distances([task.pose.region])
    to_targets = [world.distances(target) for target in targets]
    ranked = []
    for wall in world.walls:
        beside = world.neighbours(wall)
        near = [r for r in beside if r in found.confined]
        far = [r for r in beside if r not in found.confined]
        if not near or len(beside) < 2 or (found.lost and not far):
            continue
        ways = [min((d[r] for r in far or near if r in d), default=None) for d in to_targets]
        known = [way for way in ways if way is not None]
        if known:
            before = min((from_start[r] for r in near if r in from_start), default=0)
            ranked.append((len(ways) - len(known), before + min(known), wall))
    return [wall for *_, wall in sorted(ranked)]


def _resolvable(
    wall: Region, open_map: RegionMap, scenario: Scenario, robot: Robot
) -> Iterator[tuple[Obstacle, tuple[str, ...]]]:
    """Yield obstacles that could be there, each with the robots that could resolve it: with their
    own start, past the closed obstacle, within their mobility."""
    types: dict[str, ObstacleType] = {o.type.name: o.type for o in scenario.obstacles}
    types = {**scenario.catalogue.obstacles, **types}
    for kind in types.values():
        obstacle = Obstacle(kind, wall, True if kind.has_truth else None)
        helpers = []
        if len(kind.needs) > 1 or kind.needs[0].robots > 1:
            continue  # it takes several actions or helpers
        for other in scenario.robots:
            if kind.action not in other.capabilities:
                continue
            closed = {wall} if obstacle.closed_to(other) else set()
            reach = Reachability(other.model.mobility, other.start, open_map, closed)
            if reach.reaches(frozenset(obstacle.resolution_regions(open_map))):
                helpers.append(other.name)
        if helpers:
            helpers.sort(key=lambda name: name != robot.name)
            yield obstacle, tuple(helpers)


def _fewest_walls(world: RegionMap, task: Task, target: frozenset[Region]) -> list[Region]:
    """Return the walls on a path from start to target that crosses as few as possible."""
    start = task.pose.region
    before: dict[Region, Region] = {start: start}
    cost = {start: 0}
    queue = deque([start])
    while queue:
        region = queue.popleft()
        steps = (world.step(region, heading) for heading in Heading)
        for beside in (step for step in steps if step is not None):
            toll = cost[region] + (beside in world.walls)
            if toll >= cost.get(beside, world.size):
                continue
            cost[beside], before[beside] = toll, region
            if beside in world.walls:
                queue.append(beside)
            else:
                queue.appendleft(beside)
    nearest = min((r for r in target if r in cost), key=lambda r: cost[r], default=start)
    way = []
    while nearest != start:
        if nearest in world.walls:
            way.append(nearest)
        nearest = before[nearest]
    return sorted(way)


def without_walls(scenario: Scenario, walls: Sequence[Region]) -> Scenario:
    """Return the scenario with these walls taken away."""
    world = replace(scenario.map, walls=scenario.map.walls - {*walls})
    return replace(scenario, map=world)


def without_words(walls: Sequence[Region], words: str = "") -> tuple[tuple[str, str], ...]:
    """Return the item that taking these walls away changes. ``words``: the walls, if not their
    numbers."""
    return (("map", f"no wall at {words or ', '.join(map(str, walls))}"),)
