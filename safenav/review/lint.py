"""Probable errors in a valid scenario: warnings of ``safenav check``.

These are obstacles that block no robot; robots larger than a region or without room to turn; keys
without effect; literal patrols of robots in joint plans; misspelt layers or capabilities.
"""

from collections.abc import Iterator, Mapping
from math import floor

from safenav.pace.robot import Figures, least_side
from safenav.scenario.model import Clock, Obstacle, Robot, Scenario
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.yaml.findings import closest
from safenav.team.team import team_of

_SLIP, _SLIP_OF_ACTION = 0.8, 0.7
"""Similarities of two words (and of unused actions) above which one is probably misspelt."""


def lint(scenario: Scenario) -> tuple[str, ...]:
    """Return the warnings, one sentence each, in the scenario's terms."""
    found = [*scenario.map.notes, *_misnamed(scenario)]
    for obstacle in scenario.obstacles:
        found += _unnoticed(obstacle, scenario)
    if all(robot.model.battery is None for robot in scenario.robots):
        given = {"chargers": scenario.chargers, "flat": scenario.flat}
        found += [f"'{key}' has no effect: no robot has a battery" for key in given if given[key]]
    if scenario.clock is Clock.LIVE and scenario.expect.ticks is not None:
        found.append(
            "'ticks' of expect has no effect in a live run: its ticks have no fixed length"
        )
    found += [*oversized(scenario), *cramped(scenario), *_alternating(scenario)]
    return tuple(dict.fromkeys(found))


def _alternating(scenario: Scenario) -> Iterator[str]:
    """Yield the robots with a literal patrol, which joint plans do not obey."""
    literal = {r.name for r in scenario.robots if r.objective.strict and r.objective.literal}
    for member in team_of(scenario).members if literal else ():
        if member.planned and member.name in literal:
            yield (
                f"{member.name} does not keep 'form: literal': a joint plan drives it, so it may "
                "cross a target on the way and wait at one"
            )


def oversized(scenario: Scenario) -> Iterator[str]:
    """Yield the robots larger than a region of a map in metres. Coordination keeps robots in
    different regions, but their bodies would reach into neighbouring ones."""
    for robot, side, size, _ in _in_metres(scenario):
        if size > side:
            yield (
                f"{robot.name} ({robot.model.name}, {size:g} m) is larger than a region "
                f"({side:g} m) and reaches into the next ones, where other robots may be; give the "
                "map larger regions"
            )


def cramped(scenario: Scenario) -> Iterator[str]:
    """Yield the robots that fit into a region of a map in metres but cannot turn there. They have
    no computable motion, and live runs do not simulate their true durations."""
    for robot, side, size, motion in _in_metres(scenario):
        if motion is None or size > side:
            continue
        if need := least_side(motion, side):
            yield (
                f"{robot.name} ({robot.model.name}, {motion.kind}, {size:g} m) has no room to "
                f"move in a region ({side:g} m): its motion needs {need:g} m; give the map "
                "larger regions"
            )


def imprecise(scenario: Scenario, tolerances: Mapping[str, float]) -> Iterator[str]:
    """Yield the robots that may stop so far from a region's centre that they reach into another.
    ``tolerances``: each robot's maximum distance from the centre, in metres."""
    for robot, side, size, _ in _in_metres(scenario):
        off, room = tolerances[robot.name], (side - size) / 2
        if room < 0 or off <= room + 1e-9:
            continue
        most = floor(100 * room) / 100
        remedy = f"set its 'tolerance' in the fleet file to {most:g}"
        yield (
            f"{robot.name} may arrive {off:g} m from the centre of a region ({side:g} m): its "
            f"body ({size:g} m) then reaches {off - room:.2f} m into the next one, where other "
            f"robots may be; {remedy if most else 'give the map larger regions'}"
        )


def _in_metres(scenario: Scenario) -> Iterator[tuple[Robot, float, float, Figures | None]]:
    """Yield each robot of known size on a map in metres, with the side of a region, the robot's
    size and its motion (``RobotModel.figures``)."""
    if scenario.map.frame is None:
        return
    side = scenario.map.frame.resolution
    for robot in scenario.robots:
        figures = robot.model.figures
        size = figures.values["size"] if figures else robot.model.size
        if size is not None:
            yield robot, side, size, figures


def _unnoticed(obstacle: Obstacle, scenario: Scenario) -> Iterator[str]:
    """Yield the obstacles that no robot requests, since robots encounter only obstacles that block
    them."""
    if obstacle.type.blocks == frozenset() and not obstacle.ordered:
        what = f"{obstacle.type.name}@{scenario.map.word(obstacle.region)}"
        yield f"no robot encounters {what}, because it blocks no robot; list it under 'orders'"


def _misnamed(scenario: Scenario) -> Iterator[str]:
    """Yield probably misspelt layers and capabilities: a robot alone on its layer avoids no robot,
    and an action that no obstacle type needs has no use."""
    layers = {model.layer for model in built_in().robots.values()}
    used = needed_actions(scenario)
    for model in dict.fromkeys(robot.model for robot in scenario.robots):
        slip = model.layer.isalpha() and model.layer not in layers
        for meant in closest(model.layer, layers, _SLIP) if slip else ():
            yield f"layer '{model.layer}' of {model.name}; did you mean '{meant}'?"
        for word in sorted(model.capabilities - used):
            for meant in closest(word, used - model.capabilities, _SLIP_OF_ACTION):
                found = f"capability '{word}' of {model.name}: no obstacle type needs it"
                yield f"{found}; did you mean '{meant}'?"


def needed_actions(scenario: Scenario) -> frozenset[str]:
    """Return the actions that some obstacle type needs."""
    types = (*built_in().obstacles.values(), *scenario.catalogue.obstacles.values())
    own = (obstacle.type for obstacle in scenario.obstacles)
    return frozenset(need.action for kind in (*types, *own) for need in kind.needs)
