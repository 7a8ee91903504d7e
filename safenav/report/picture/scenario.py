"""A scenario before any run, as a scene and as text."""

from __future__ import annotations

from msgspec.structs import replace

from safenav.report.terminal.map import FREE, MapPicture, Marker, draw, with_names
from safenav.run.looks import labels
from safenav.run.reading import run_of
from safenav.run.run import Shading
from safenav.run.values import ObstacleStatus, Scene
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import describe, target_regions
from safenav.trace.reading import unstarted
from safenav.trace.words import listed, obstacle_words, regions_words
from safenav.world.map import Region, RegionMap
from safenav.world.poses import bits
from safenav.world.sight import visible_from


def scene_of(scenario: Scenario) -> Scene:
    """Return the scene of starts, objectives and hidden obstacles."""
    run = replace(run_of(unstarted(scenario)), charges={})
    obstacles = tuple((hidden, ObstacleStatus.HIDDEN, 0) for hidden in run.hidden.values())
    return replace(run.at(0), moment="before the run", obstacles=obstacles)


def sight_of(scenario: Scenario, robot: str) -> Shading:
    """Return a robot's sight from its start, without hidden obstacles."""
    viewer = next(r for r in scenario.robots if r.name == robot)
    view = visible_from(scenario.map, viewer.model.vision)
    seen = frozenset(bits(view.mask(viewer.start.region)))
    return Shading(robot, viewer.model.vision, seen)


def scenario_text(scenario: Scenario, width: int) -> list[str]:
    """Return the scenario as lines of text: the map with its rows and columns, then the meanings of
    its marks.

    Free regions show their numbers if the map then fits into ``width`` characters."""
    sign = labels([robot.name for robot in scenario.robots])
    digits = len(str(scenario.map.size - 1))
    mark = max(len(label) for label in [" ", *sign.values()])
    numbered = scenario.map.cols * (digits + mark + 2) + _beside(scenario.map) <= width
    drawn = _numbered(scenario, sign, digits) if numbered else _plain(scenario, sign)
    lines = [scenario.name, "", *_with_axes(drawn, scenario.map), ""]
    lines += [*_robots(scenario, sign), *_obstacles(scenario)]
    marked = bool(scenario.robots or scenario.obstacles)
    if numbered and marked:
        lines.append("  a capital letter: a robot; a small one: its target; ?: an obstacle")
    elif not numbered:
        marks = "o: a target; ▒▒: an obstacle; " if marked else ""
        lines.append(f"  {marks}a wider terminal shows region numbers")
    return lines + _exclusions(scenario) + _names(scenario.map)


def _beside(world: RegionMap) -> int:
    """Return the width, in characters, of the row numbers beside the map."""
    return len(str(world.rows - 1)) + 1


def _with_axes(lines: list[str], world: RegionMap) -> list[str]:
    """Return a drawing with row numbers beside it and column numbers above it: all of them if each
    has room for a blank after it, else every fifth."""
    beside, cell = _beside(world), len(lines[0]) // world.cols
    every = 1 if len(str(world.cols - 1)) < cell else 5
    columns = "".join(f"{col:<{cell * every}}" for col in range(0, world.cols, every))
    rows = [f"{row:>{beside - 1}} {line}" for row, line in enumerate(lines)]
    return [f"{' ' * beside}{columns.rstrip()}", *rows]


def _numbered(scenario: Scenario, sign: dict[str, str], digits: int) -> list[str]:
    """Return the map as lines, each region with its mark and number. A robot's mark replaces that
    of an obstacle, which replaces that of a target."""
    marks: dict[Region, str] = {}
    for robot in scenario.robots:
        for region in target_regions(robot.objective):
            marks[region] = sign[robot.name].lower()
    marks |= {obstacle.region: "?" for obstacle in scenario.obstacles}
    marks |= {robot.start.region: sign[robot.name] for robot in scenario.robots}

    mark = max(len(label) for label in [" ", *sign.values()])
    apart = " " if mark > 1 else ""  # separates a digit at the end of a label from the number

    def cell(world: RegionMap, region: Region) -> str:
        if region in world.walls:
            return "█" * (digits + mark + 1 + len(apart))
        return f"{marks.get(region, ''):>{mark + 1}}{apart}{region:<{digits}}"

    world = scenario.map
    lines = [
        "".join(cell(world, world.region(row, col)) for col in range(world.cols))
        for row in range(world.rows)
    ]
    return with_names(lines, world, digits + mark + 1 + len(apart), marks.__contains__)


def _plain(scenario: Scenario, sign: dict[str, str]) -> list[str]:
    robots = [
        Marker(sign[robot.name], robot.start.region, robot.start.heading)
        for robot in scenario.robots
    ]
    targets = [region for robot in scenario.robots for region in target_regions(robot.objective)]
    closed = {obstacle.region: obstacle.name for obstacle in scenario.obstacles}
    lines = draw(scenario.map, MapPicture(robots, closed=closed, targets=targets))
    taken = {*targets, *closed, *(robot.region for robot in robots)}
    return with_names(lines, scenario.map, len(FREE), taken.__contains__)


def _robots(scenario: Scenario, sign: dict[str, str]) -> list[str]:
    world = scenario.map
    return [
        f"  {sign[robot.name]}  {robot.name} ({robot.model.name}) at "
        f"{world.stance(robot.start.region, robot.start.heading)}: "
        f"{describe(robot.objective, world.word)}"
        for robot in scenario.robots
    ]


def _names(world: RegionMap) -> list[str]:
    places = ", ".join(world.label(region) for region in world.names.values())
    named = (f"  {name}: {regions_words(area)}" for name, area in world.areas.items())
    return [*([f"  names: {places}"] if places else []), *named]


def _obstacles(scenario: Scenario) -> list[str]:
    lines = []
    for obstacle in scenario.obstacles:
        word = scenario.map.word
        needs = []
        for number, need in enumerate(obstacle.needs):
            where = ", ".join(map(word, obstacle.resolution_regions(scenario.map, number)))
            group = f" by {need.robots} robots" if need.robots > 1 else ""
            needs.append(f"{need.action}{group} at {where or 'nowhere'}")
        status = f"ordered at tick {obstacle.appears}" if obstacle.ordered else "hidden"
        lines.append(
            f"  ?  {obstacle_words(obstacle.name, word)}: {status} at "
            f"{scenario.map.label(obstacle.region)}, needs {', then '.join(needs)}, "
            f"{_blocked(obstacle, scenario)}"
        )
    return lines


def _exclusions(scenario: Scenario) -> list[str]:
    return [
        f"  at most one of {listed(sorted(each.robots))} is in "
        f"{regions_words(each.regions, scenario.map.word)} at a time"
        for each in scenario.never_together
    ]


def _blocked(obstacle: Obstacle, scenario: Scenario) -> str:
    """Return the robots that an obstacle stops, and those that resolve it by entering."""
    names = [robot.name for robot in scenario.robots]
    stopped = [robot.name for robot in scenario.robots if obstacle.blocks(robot)]
    others = [name for name in names if name not in stopped]
    whom = listed(stopped)
    if stopped and len(others) < len(stopped):
        whom = f"every robot except {listed(others)}" if others else "every robot"
    last = len(obstacle.needs) - 1
    enter = [r.name for r in scenario.robots if obstacle.resolved_by_entering(r, last)]
    entering = [name for name in enter if name in stopped]
    if not entering:
        return f"blocks {whom}"
    verb = "resolves" if len(entering) == 1 else "resolve"
    return f"blocks {whom}; {listed(entering)} {verb} it by entering"
