"""Events of a run: hidden ``obstacles``, ``orders``, ``changes`` for robots, ``inputs``; and its
expected result: ``expect``, and ``requirements`` in signal temporal logic."""

from collections.abc import Iterator, Mapping, Sequence

from safenav.formula.parser import FormulaError
from safenav.scenario import language, values
from safenav.scenario.model import Input, Obstacle, ObstacleType, RobotChange
from safenav.scenario.objective import Objective, unordered
from safenav.scenario.reading.regions import Reading
from safenav.scenario.reading.robots import misses_targets, resolve_objective
from safenav.scenario.yaml.document import Node, Scalar, clipped, entries_of
from safenav.scenario.yaml.keys import MOST
from safenav.scenario.yaml.typed import read


def resolve_obstacles(
    items: Sequence[language.ObstacleKeys] | None, node: Node | None, reading: Reading
) -> None:
    """Add the readable obstacles to ``reading``. Report errors in the other entries."""
    reading.keep(obstacles_of(items or (), reading), node)


def obstacles_of(items: Sequence[language.ObstacleKeys], reading: Reading) -> list[Obstacle]:
    """Return the readable obstacles. Report errors in the other entries."""
    found: list[Obstacle] = []
    for item in items:
        obstacle, where = _obstacle(item, reading), item.at("region")
        if obstacle is None:
            continue
        for first in found:
            if first.region == obstacle.region and _meet(first, obstacle):
                message = f"{obstacle.name}: the region already contains {first.name}"
                hint = "a region holds one obstacle at a time: give the first one 'until'"
                reading.add(where, message, hint)
                break
        else:
            found.append(obstacle)
        for robot in reading.team:
            if obstacle.shuts_in(robot):
                message = f"{obstacle.name} is where {robot.name} starts, and blocks it"
                acts = any(need.action in robot.capabilities for need in obstacle.needs)
                alone = f": {robot.name} alone does not resolve it from inside" if acts else ""
                reading.add(where, message, f"move one of them{alone}")
    return found


def _meet(one: Obstacle, other: Obstacle) -> bool:
    """Return whether both obstacles are present in some tick."""
    ends = (one.goes or MOST, other.goes or MOST)
    return max(one.appears or 0, other.appears or 0) < min(ends)


def _obstacle(item: language.ObstacleKeys, reading: Reading) -> Obstacle | None:
    before, kind, appears, goes = len(reading), item.type, item.from_, item.until
    truth = _truth(item, kind, reading)
    if appears is not None and goes is not None and appears >= goes:
        label = kind.name if kind else "the obstacle"
        hint = "'from' is the tick at which it appears, 'until' that at which it disappears"
        reading.add(item.at("until"), f"'until' of {label} is not after 'from'", hint)
    if item.flawed or kind is None or item.region is None or len(reading) > before:
        return None
    return Obstacle(kind, item.region, truth, appears, goes, item.resolve_within)


def resolve_orders(
    items: Sequence[language.OrderKeys] | None, node: Node | None, reading: Reading
) -> None:
    """Add the tasks of the team during the run to ``reading``, as obstacles that block no robot."""
    found: list[Obstacle] = []
    for item in items or ():
        at, kind, region = item.at_, item.type, item.region
        if at is not None and kind is not None and region is not None:
            truth = True if kind.has_truth else None
            number = 1 + sum(o.type is kind and o.region == region for o in found)
            limit = item.resolve_within
            found.append(Obstacle(kind, region, truth, at, None, limit, True, number))
    reading.keep(found, node)


def _truth(item: language.ObstacleKeys, kind: ObstacleType | None, reading: Reading) -> bool | None:
    """Return whether an obstacle's region is traversable (default: True; None: no truth)."""
    if kind is not None and kind.has_truth:
        return item.traversable is not False
    if kind is not None and item.at("traversable") is not None:
        having = [o.name for o in reading.catalogue.obstacles.values() if o.has_truth]
        hint = f"types that reveal a truth: {', '.join(having)}" if having else ""
        reading.add(item.at("traversable"), f"a {kind.name} has no 'traversable' to reveal", hint)
    return None


_SERVICE = {"out": False, "back": True}


def read_changes(node: Node | None, reading: Reading) -> tuple[RobotChange, ...]:
    """Return the readable changes of a list by tick. Report errors in the other entries."""
    items = read(tuple[language.ChangeKeys, ...], node, "changes", reading)
    return resolve_changes(items or (), reading)


def resolve_changes(
    items: Sequence[language.ChangeKeys], reading: Reading
) -> tuple[RobotChange, ...]:
    """Return the readable changes by tick. Those of one tick are in the order of the file."""
    found = [_change(item, reading) for item in items]
    return tuple(sorted((c for c in found if c is not None), key=lambda change: change.at))


def _change(item: language.ChangeKeys, reading: Reading) -> RobotChange | None:
    before, name = len(reading), item.robot
    objective = _objective(item, name, reading)
    if item.flawed or item.at_ is None or name is None or len(reading) > before:
        return None
    active = _SERVICE[item.service] if item.service else None
    within = None if item.objective is None else item.objective.within
    return RobotChange(item.at_, name, objective, active, within)


def _objective(item: language.ChangeKeys, name: str | None, reading: Reading) -> Objective | None:
    given, node = item.objective, item.at("objective")
    if given is None:
        return None
    robot = next((robot for robot in reading.team if robot.name == name), None)
    found = resolve_objective(given, None if robot is None else robot.model.mobility, reading)
    if robot is not None and robot.when:
        reading.add(node, f"objective of {name}: its 'when' determines it")
    if robot is not None:
        if robot.model.battery is not None and (error := unordered(robot.name, found)):
            reading.add(node, *error)
        misses_targets(robot, found, given, reading)
    return found


def resolve_inputs(
    items: Mapping[Scalar, Input] | None, node: Node | None, reading: Reading
) -> None:
    """Add the inputs to ``reading``. Report errors."""
    for key in items or ():
        reading.check_variable(key)
    reading.input_names = tuple(key.text for key, _ in entries_of(node))
    reading.inputs = tuple((items or {}).values())


_WHAT = "requirements"


def resolve_requirements(given: values.Requirements | None, reading: Reading) -> dict[str, str]:
    """Return the formulas by name. The text of a formula is its default name."""
    found: dict[str, str] = {}
    for name, item in _entries(given):
        what, text = _WHAT if name is None else f"requirement {clipped(name.text)}", item.text
        if not item.style and text.count("(") > text.count(")"):
            message = f"{what}: '{clipped(text)}' ends within parentheses"
            reading.add(item, message, "within brackets a comma ends a formula: put it in quotes")
            break  # the next items are the rest of the formula
        label = text if name is None else name.text
        if label in found:
            reading.add(name or item, f"{_WHAT}: '{clipped(label)}' already exists")
        formula = " ".join(_formula(item, text, what, reading).split())
        found[formula if name is None else label] = formula
    return found


def _entries(given: values.Requirements | None) -> Iterator[tuple[Scalar | None, Scalar]]:
    for part in given if isinstance(given, tuple) else (given or {},):
        yield from part.items() if isinstance(part, dict) else [(None, part)]


def _formula(node: Scalar, text: str, what: str, reading: Reading) -> str:
    """Return a formula as text with numbers of regions in its events."""
    # Imported here since few scenarios have requirements.
    from safenav.stl.syntax import Happens, RobotSignal, nodes, parse_requirement

    try:
        tree = parse_requirement(text)
    except FormulaError as error:
        reading.add(node, f"{what}: {error.found}", error.hint, error.column)
        return text
    events = []
    for part in nodes(tree):
        if isinstance(part, RobotSignal):
            for robot, column in zip(part.robots, part.columns, strict=True):
                if reading.named and robot not in reading.named:
                    found = f"{what}: no robot is named"
                    reading.unknown(node, found, robot, reading.named, column=column)
        elif isinstance(part, Happens):
            events.append(part)
    for event in sorted(events, key=lambda event: -event.column):
        begin = event.column + len(event.kind)
        name = reading.names_obstacle(node, event.obstacle, what, begin + 1)
        text = f"{text[:begin]}{name or event.obstacle}{text[begin + len(event.obstacle) :]}"
    return text
