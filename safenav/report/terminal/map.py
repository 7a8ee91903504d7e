"""The map as text: two characters per region, robots as labels, obstacles as blocks; and a scenario
before its run, with region numbers if there is room.

Two robots above each other (one flies) share a region's two characters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from msgspec import Struct, field

from safenav.run.looks import labels
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import describe, target_regions
from safenav.trace.words import listed, obstacle_words, regions_words
from safenav.world.map import Heading, Region, RegionMap

ARROWS = {Heading.NORTH: "^", Heading.EAST: ">", Heading.SOUTH: "v", Heading.WEST: "<"}
WALL = "██"
FREE = " ·"


class Marker(Struct, frozen=True):
    """A robot to draw: its label of one or two characters, its region, and its heading (shown
    beside a label of one character)."""

    letter: str
    region: Region
    heading: Heading | None = None


class MapPicture(Struct, frozen=True):
    """Contents of the map besides the walls. ``closed``: open obstacles by region; ``barred``:
    permanent obstacles by region; ``targets``: regions marked faintly."""

    markers: Sequence[Marker] = ()
    closed: Mapping[Region, str] = field(default_factory=dict)
    barred: Mapping[Region, str] = field(default_factory=dict)
    targets: Collection[Region] = ()


def legend(picture: MapPicture) -> list[str]:
    """Return the meanings of the marks on the map, except those of single robots."""
    lines = [
        f"{_shared(here)} {' and '.join(marker.letter for marker in here)} in one region"
        for here in _by_region(picture).values()
        if len(here) > 1
    ]
    lines += [f"▒▒ {name}" for name in picture.closed.values()]
    lines += [f"XX {name}, blocked" for name in picture.barred.values()]
    return [*lines, " o target of an objective"] if picture.targets else lines


def _by_region(picture: MapPicture) -> dict[Region, list[Marker]]:
    found: dict[Region, list[Marker]] = {}
    for marker in picture.markers:
        found.setdefault(marker.region, []).append(marker)
    return found


def _shared(here: Sequence[Marker]) -> str:
    """Return the two characters of robots that share a region."""
    return "".join(marker.letter[-1] for marker in here)[:2]


def draw(world: RegionMap, picture: MapPicture) -> list[str]:
    """Return the map as lines of text, row 0 first."""
    standing = _by_region(picture)
    return _rows([_cell(r, world, picture, standing.get(r, [])) for r in range(world.size)], world)


def _rows(cells: Sequence[str], world: RegionMap) -> list[str]:
    return ["".join(cells[i : i + world.cols]) for i in range(0, world.size, world.cols)]


def _cell(region: Region, world: RegionMap, picture: MapPicture, here: list[Marker]) -> str:
    if len(here) == 1:
        heading, sign = here[0].heading, here[0].letter
        if len(sign) == 2:
            return sign
        return sign + (ARROWS[heading] if heading is not None else " ")
    if here:
        return _shared(here)
    if region in world.walls:
        return WALL
    if region in picture.barred:
        return "XX"
    if region in picture.closed:
        return "▒▒"
    return " o" if region in picture.targets else FREE


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
    return _rows([cell(world, region) for region in range(world.size)], world)


def _plain(scenario: Scenario, sign: dict[str, str]) -> list[str]:
    robots = [
        Marker(sign[robot.name], robot.start.region, robot.start.heading)
        for robot in scenario.robots
    ]
    targets = [region for robot in scenario.robots for region in target_regions(robot.objective)]
    closed = {obstacle.region: obstacle.name for obstacle in scenario.obstacles}
    return draw(scenario.map, MapPicture(robots, closed=closed, targets=targets))


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
