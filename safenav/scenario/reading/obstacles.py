"""The ``obstacles:`` of a scenario (hidden until encountered) and its ``orders``."""

from __future__ import annotations

from collections.abc import Sequence

from safenav.scenario import language
from safenav.scenario.model import Obstacle, ObstacleType
from safenav.scenario.reading.catalogue import type_named
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.typed import MOST


def resolve_obstacles(
    items: Sequence[language.ObstacleKeys], reading: Reading
) -> tuple[Obstacle, ...]:
    """Return the readable obstacles; errors in the others are reported."""
    found: list[Obstacle] = []
    for item in items:
        obstacle, where = _obstacle(item, reading), item.at("region")
        if obstacle is None:
            continue
        for first in found:
            if first.region == obstacle.region and _meet(first, obstacle):
                message = f"{obstacle.name}: the region already contains {first.name}"
                reading.add(where, message, "a region holds one hidden obstacle")
                break
        else:
            found.append(obstacle)
        for robot in reading.team:
            if obstacle.shuts_in(robot):
                message = f"{obstacle.name} is where {robot.name} starts, and blocks it"
                acts = any(need.action in robot.capabilities for need in obstacle.needs)
                alone = f": {robot.name} alone does not resolve it from inside" if acts else ""
                reading.add(where, message, f"move one of them{alone}")
    return tuple(found)


def _meet(one: Obstacle, other: Obstacle) -> bool:
    """Return whether both are present in some tick."""
    ends = (one.goes or MOST, other.goes or MOST)
    return max(one.appears or 0, other.appears or 0) < min(ends)


def _obstacle(item: language.ObstacleKeys, reading: Reading) -> Obstacle | None:
    before = len(reading)
    kind = type_named(item.type, "'type' of an obstacle", reading)
    region, appears, goes = reading.region(item.region), item.from_, item.until
    truth = _truth(item, kind, reading)
    if appears is not None and goes is not None and appears >= goes:
        label = kind.name if kind else "the obstacle"
        hint = "'from' is the tick at which it appears, 'until' that at which it disappears"
        reading.add(item.at("until"), f"{label} disappears before it appears", hint)
    if item.flawed or kind is None or region is None or len(reading) > before:
        return None
    return Obstacle(kind, region, truth, appears, goes, item.resolve_within)


def resolve_orders(items: Sequence[language.OrderKeys], reading: Reading) -> tuple[Obstacle, ...]:
    """Return the tasks that the team receives during the run, as obstacles that block no robot."""
    found: list[Obstacle] = []
    for item in items:
        kind = type_named(item.type, item.named("type"), reading)
        at, region = item.at_, reading.region(item.region)
        if kind is not None and kind.blocks != frozenset():
            message = f"an order of {kind.name}, which stops robots"
            reading.add(item.at("type"), message, f"give {kind.name} 'blocks: []'")
        elif at is not None and kind is not None and region is not None:
            truth = True if kind.has_truth else None
            number = 1 + sum(o.type is kind and o.region == region for o in found)
            limit = item.resolve_within
            found.append(Obstacle(kind, region, truth, at, None, limit, True, number))
    return tuple(found)


def _truth(item: language.ObstacleKeys, kind: ObstacleType | None, reading: Reading) -> bool | None:
    """Return the truth of an obstacle: traversable by default; None for a type without a truth."""
    stray = item.at("traversable")
    if kind is None or kind.has_truth or stray is None:
        return item.traversable is not False if kind is not None and kind.has_truth else None
    having = [o.name for o in reading.catalogue.obstacles.values() if o.has_truth]
    hint = f"types that reveal a truth: {', '.join(having)}" if having else ""
    reading.add(stray, f"a {kind.name} has no 'traversable' to reveal", hint)
    return None
