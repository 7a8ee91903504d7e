"""A robot that joins a scenario: one item of ``robots``, read and checked among the others."""

from __future__ import annotations

from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.scenario import language
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.compatibility import conflicts
from safenav.scenario.reading.regions import Reading
from safenav.scenario.reading.robots import resolve_robots
from safenav.scenario.values import RobotName
from safenav.scenario.yaml.document import clipped, entries_of
from safenav.scenario.yaml.source import parsed
from safenav.scenario.yaml.typed import read

FORM = "NAME: {model: ..., start: ..., objective: ...}"


def joined(scenario: Scenario, text: str) -> Scenario:
    """Return the scenario with one more robot. ``text``: as an item of ``robots`` in a scenario
    file, such as ``cart2: {model: turtlebot4, start: [2, 3], objective: {visit: [dock, [4, 4]]}}``.
    The region of a lost robot in conflict with it is also closed to it. Raises UsageError with all
    errors."""
    reading = Reading("the robot", world=scenario.map)
    reading.inputs = tuple(each.name for each in scenario.inputs)
    known = {robot.model.name: robot.model for robot in scenario.robots}
    robots = {**scenario.catalogue.robots, **known}
    reading.catalogue = replace(scenario.catalogue, robots=robots)
    root = parsed(text, reading)
    known_names = tuple(robot.name for robot in scenario.robots)
    for key, _ in entries_of(root):
        if key.text in known_names:
            message = f"the team has a robot {clipped(key.text)} already"
            reading.add(key, message, "choose another name")
    reading.named = (*(key.text for key, _ in entries_of(root)), *known_names)
    team = read(dict[RobotName, language.RobotKeys], root, "robots", reading)
    found = resolve_robots(team or {}, reading, scenario.robots)
    reading.refuse_if_any()
    if len(found) != 1:
        raise UsageError(f"one robot joins at a time; expected: {FORM}")
    (robot,) = found
    obstacles = tuple(_closed_too(obstacle, robot, scenario) for obstacle in scenario.obstacles)
    begun = scenario.begun and replace(scenario.begun, plan=None)  # the robot may block it
    robots_then = (*scenario.robots, robot)
    then = replace(scenario, robots=robots_then, obstacles=obstacles, begun=begun)
    before = conflicts(scenario)
    for each in conflicts(then):
        if each not in before:
            reading.add(None, each.found, each.hint)
    reading.refuse_if_any()
    return then


def _closed_too(obstacle: Obstacle, robot: Robot, scenario: Scenario) -> Obstacle:
    """Return the obstacle; that of a lost robot is closed to ``robot`` if they are in conflict."""
    kind = obstacle.type
    missing = next((r for r in scenario.robots if kind.name == f"lost_{r.name}"), None)
    if missing is None or kind.blocks is None or not missing.conflicts(robot):
        return obstacle
    return replace(obstacle, type=replace(kind, blocks=kind.blocks | {robot.name}))
