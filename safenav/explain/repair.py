"""Repairs: changes of the scenario that give the robot a strategy.

Candidates follow from the cause, the likeliest first. Graph search excludes hopeless ones, and the
synthesizer checks each repair before it is offered. On the map, an obstacle that a robot can
resolve replaces a wall, or the wall is removed. Single walls are tried in the order of the shortest
path through them. If none suffices, all walls on the path with the fewest walls are tried."""

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from typing import TypeVar

from msgspec.structs import replace

from safenav.explain.explanation import NoStrategyCause, Repair, RepairKind, RepairProblem, play
from safenav.formula.parser import parse
from safenav.formula.syntax import variables
from safenav.scenario.model import Obstacle, ObstacleType, Robot, Scenario
from safenav.scenario.objective import Ltl, Objective, Word, alternation, written
from safenav.scenario.reading.loader import conflicts
from safenav.scenario.yaml.document import flow
from safenav.spec.task import NO_MEMORY, Task
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.poses import Mobility, Pose
from safenav.world.reachability import Reachability


def open_walls(problem: RepairProblem) -> Iterator[Repair]:
    """Yield scenarios with an obstacle in place of a wall, and the robots that can resolve it."""
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
                obstacle.needs[0].action,
            )


def removed_walls(problem: RepairProblem) -> Iterator[Repair]:
    """Yield scenarios without a single wall, or without the fewest walls that block the robot."""
    scenario, lost = problem.scenario, problem.diagnosis.lost
    ways = [[wall] for wall in _single_walls(problem)]
    fewest = (_fewest_walls(scenario.map, problem.task, target) for target in lost)
    for way in (*ways, *(way for way in fewest if len(way) > 1)):
        yield Repair(RepairKind.REMOVE_WALLS, without_words(way), without_walls(scenario, way))


def _single_walls(problem: RepairProblem) -> list[Region]:
    """Return the walls at the border of the robot's reachable regions, ordered by the length of the
    path to the targets through the wall."""
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
    """Yield the obstacles that could replace a wall, each with the robots that could resolve it:
    they can reach it from their start while it is closed."""
    types: dict[str, ObstacleType] = {o.type.name: o.type for o in scenario.obstacles}
    types = {**scenario.catalogue.obstacles, **types}
    for kind in types.values():
        obstacle = Obstacle(kind, wall, True if kind.has_truth else None)
        helpers = []
        if len(kind.needs) > 1 or kind.needs[0].robots > 1:
            continue  # its resolution takes several actions or helpers
        for other in scenario.robots:
            if kind.needs[0].action not in other.capabilities:
                continue
            closed = {wall} if obstacle.closed_to(other) else set()
            reach = Reachability(other.model.mobility, other.start, open_map, closed)
            if reach.reaches(frozenset(obstacle.resolution_regions(open_map))):
                helpers.append(other.name)
        if helpers:
            helpers.sort(key=lambda name: name != robot.name)
            yield obstacle, tuple(helpers)


def _fewest_walls(world: RegionMap, task: Task, target: frozenset[Region]) -> list[Region]:
    """Return the walls on a path from start to target that crosses as few walls as possible."""
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
    """Return the scenario without these walls."""
    world = replace(scenario.map, walls=scenario.map.walls - {*walls})
    return replace(scenario, map=world)


def without_words(walls: Sequence[Region], words: str = "") -> tuple[tuple[str, str], ...]:
    """Return the scenario item that changes if these walls are removed, and its new value in words.
    ``words``: names for walls in place of their numbers."""
    return (("map", f"no wall at {words or ', '.join(map(str, walls))}"),)


Result = TypeVar("Result")
Judge = Callable[[Scenario], bool]
"""A function that returns whether the robot has a strategy at a scenario's start."""

OFFERED = 2
"""Maximum number of offered repairs of one kind."""
TRIED = 8
"""Maximum number of candidates of one kind that the synthesizer checks."""
LOOKED_AT = 40
"""Maximum number of regions examined as another start."""

C, K = NoStrategyCause, RepairKind
_FIRST: dict[NoStrategyCause, tuple[RepairKind, ...]] = {
    C.NO_WAY: (K.OPEN_WALL, K.REMOVE_WALLS, K.START, K.OBJECTIVE),
    C.OBSTACLE: (K.OBJECTIVE, K.OPEN_WALL, K.REMOVE_WALLS),
    C.HEADING: (K.HEADING, K.START, K.MOBILITY),
    C.ONE_WAY: (K.MOBILITY, K.OPEN_WALL, K.REMOVE_WALLS, K.OBJECTIVE),
    C.CROSSING: (K.OBJECTIVE, K.OPEN_WALL, K.REMOVE_WALLS, K.START),
    C.IMPOSSIBLE_START: (K.START, K.HEADING, K.OBJECTIVE),
    C.CONTRADICTION: (K.OBJECTIVE,),
    C.FORBIDDEN_WAY: (K.OBJECTIVE, K.START, K.HEADING, K.MOBILITY, K.OPEN_WALL),
    C.CONFLICT: (K.INPUT, K.OBJECTIVE, K.START),
    C.CORNERED: (K.INPUT, K.OBJECTIVE, K.OPEN_WALL, K.REMOVE_WALLS, K.START),
    C.KEPT_AWAY: (K.INPUT, K.OBJECTIVE, K.OPEN_WALL, K.START),
}


def find_repairs(problem: RepairProblem, judge: Judge) -> tuple[Repair, ...]:
    """Return the working repairs that are found before the deadline, the likeliest first."""
    found: list[Repair] = []
    for kind in _FIRST[problem.cause]:
        if kind is K.REMOVE_WALLS and any(repair.kind is K.OPEN_WALL for repair in found):
            continue
        candidates, given = _CANDIDATES[kind](problem), problem.scenario
        tried = offered(candidates, given, lambda new: judge(new) or None, TRIED, problem.deadline)
        found += [repair for repair, _ in tried]
    return tuple(found)


def offered(
    candidates: Iterable[Repair],
    given: Scenario,
    works: Callable[[Scenario], Result | None],
    most: int,
    deadline: float,
) -> Iterator[tuple[Repair, Result]]:
    """Yield up to OFFERED working candidates, each with its result, until the deadline (by the
    monotonic clock). At most ``most`` are tried. Candidates with errors that the ``given`` scenario
    lacks are omitted, since their files would be refused."""
    good, known = 0, {*conflicts(given)}
    loaded = (each for each in candidates if {*conflicts(each.scenario)} <= known)
    for candidate in islice(loaded, most):
        if good == OFFERED or time.monotonic() >= deadline:
            return
        result = works(candidate.scenario)
        if result is not None:
            good += 1
            yield candidate, result


def _headings(problem: RepairProblem) -> Iterator[Repair]:
    robot = problem.robot
    if robot.model.mobility is not Mobility.HEADING:
        return
    for heading in Heading:
        if heading is not robot.start.heading:
            changed = replace(robot, start=Pose(robot.start.region, heading))
            item = f"robots.{robot.name}.heading"
            yield _with_robots(K.HEADING, problem, [changed], (item, heading.label))


def _starts(problem: RepairProblem) -> Iterator[Repair]:
    """Yield other starts from which the robot alone could meet its objective, the nearest first."""
    scenario, robot = problem.scenario, problem.robot
    taken = {other.start.region for other in scenario.robots if other is not robot}
    to_targets = [scenario.map.distances(target) for target in problem.task.targets]
    within = {r for r in scenario.map.free if all(r in field for field in to_targets)}
    for region in nearest(robot.start.region, within - taken, scenario.map)[:LOOKED_AT]:
        if region == robot.start.region:
            continue
        if problem.late:
            return
        headings: tuple[Heading | None, ...] = (None,)
        if robot.start.heading is not None:
            headings = (robot.start.heading, *Heading)
        for heading in headings:
            changed = replace(robot, start=Pose(region, heading))
            if _hopeful(changed, problem):
                change = [(f"robots.{robot.name}.start", scenario.map.word(region))]
                if heading is not robot.start.heading and heading is not None:
                    change.append((f"robots.{robot.name}.heading", heading.label))
                yield _with_robots(K.START, problem, [changed], *change)
                break


def _mobility(problem: RepairProblem) -> Iterator[Repair]:
    """Yield other models of the robot's layer that can turn on the spot and have all its model's
    capabilities."""
    robot = problem.robot
    pursued = (robot.objective, robot.while_waiting, *(other for _, other in robot.when))
    faces = any(_reads_heading(each) for each in pursued if each is not None)
    if robot.model.mobility is not Mobility.HEADING or faces:
        return
    for model in problem.scenario.catalogue.robots.values():
        able = model.layer == robot.model.layer and robot.capabilities <= model.capabilities
        if able and model.mobility is Mobility.FREE:
            changed = replace(robot, model=model, start=Pose(robot.start.region))
            item = f"robots.{robot.name}.model"
            yield _with_robots(K.MOBILITY, problem, [changed], (item, model.name))


def _reads_heading(objective: Objective) -> bool:
    """Return whether a formula of an objective depends on the heading."""
    texts = objective.always
    if isinstance(objective, Ltl):
        texts = (*objective.init, *objective.safety, *objective.liveness)
    return any("heading" in variables(parse(text)) for text in texts)


def _inputs(problem: RepairProblem) -> Iterator[Repair]:
    """Yield scenarios with the assumption that an input takes a further value infinitely often."""
    scenario = problem.scenario
    for each, _ in problem.task.inputs:
        for value, word in ((False, "off"), (True, "on")):
            if value not in each.again:
                word = "both" if each.again else word
                changed = replace(each, again=(*each.again, value))
                inputs = tuple(changed if i.name == each.name else i for i in scenario.inputs)
                item = f"inputs.{each.name}.always_eventually"
                yield Repair(K.INPUT, ((item, word),), replace(scenario, inputs=inputs))


def _objectives(problem: RepairProblem) -> Iterator[Repair]:
    robot = problem.robot
    for objective, told in _milder(robot.objective, problem.scenario.map.word):
        changed = replace(robot, objective=objective)
        if isinstance(objective, Ltl) or _hopeful(changed, problem):
            part, words = told
            item = f"robots.{robot.name}.objective{part}"
            yield _with_robots(K.OBJECTIVE, problem, [changed], (item, words))


def _milder(objective: Objective, word: Word) -> Iterator[tuple[Objective, tuple[str, str]]]:
    """Yield less demanding objectives, the most demanding first, each with the changed item of the
    scenario and its new value."""
    if isinstance(objective, Ltl):
        for part in ("init", "safety", "liveness"):
            lines = getattr(objective, part)
            for place, line in enumerate(lines):
                kept = objective.changed(**{part: lines[:place] + lines[place + 1 :]})
                yield kept, (f".ltl.{part}", f"without {line}")
        return
    milder: list[Objective] = []
    if objective.literal:
        milder.append(objective.changed(literal=False))
    milder += without_rules(objective)
    if len(objective.targets) > 1 or objective.settles:
        milder += [alternation((target,), objective) for target in objective.targets]
    for each in milder:
        yield each, ("", written(each, word))


def without_rules(objective: Objective) -> Iterator[Objective]:
    """Yield the objective without one formula of ``always``, then without ``avoid``."""
    for place in range(len(objective.always)):
        kept = objective.always[:place] + objective.always[place + 1 :]
        yield objective.changed(always=kept)
    if objective.avoid:
        yield objective.changed(avoid=frozenset())


def _hopeful(robot: Robot, problem: RepairProblem) -> bool:
    """Return whether the robot alone could meet the weakest form of its objective."""
    if isinstance(robot.objective, Ltl):
        return True
    blocked = frozenset(known.region for known in problem.task.blocked)
    world = problem.scenario.map
    weakest = robot.objective.relaxed()
    solo = play(robot.model.mobility, robot.start, weakest, NO_MEMORY, world, blocked)
    return solo.winnable


def nearest(region: Region, regions: Iterable[Region], world: RegionMap) -> list[Region]:
    """Return the given regions, the nearest to ``region`` first (ignoring walls)."""
    row, col = world.position(region)

    def away(other: Region) -> tuple[int, Region]:
        r, c = world.position(other)
        return abs(r - row) + abs(c - col), other

    return sorted(regions, key=away)


def with_robots(scenario: Scenario, changed: Iterable[Robot]) -> Scenario:
    """Return the scenario in which these robots replace robots of the same names."""
    new = {robot.name: robot for robot in changed}
    robots = tuple(new.get(robot.name, robot) for robot in scenario.robots)
    return replace(scenario, robots=robots)


def _with_robots(
    kind: RepairKind, problem: RepairProblem, changed: list[Robot], *change: tuple[str, str]
) -> Repair:
    return Repair(kind, change, with_robots(problem.scenario, changed))


_CANDIDATES: dict[RepairKind, Callable[[RepairProblem], Iterator[Repair]]] = {
    K.OPEN_WALL: open_walls,
    K.REMOVE_WALLS: removed_walls,
    K.HEADING: _headings,
    K.START: _starts,
    K.MOBILITY: _mobility,
    K.OBJECTIVE: _objectives,
    K.INPUT: _inputs,
}
