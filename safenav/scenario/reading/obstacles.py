"""The ``obstacles:`` of a scenario (hidden until encountered) and its ``orders``."""

from __future__ import annotations

from safenav.scenario.model import Obstacle, ObstacleType
from safenav.scenario.reading.catalogue import TYPE
from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node
from safenav.scenario.yaml.shapes import TRUTH, Key, Table, form, many, whole

MOST_TICKS = read.MOST
TICK = whole(1, MOST_TICKS)
LIMIT = Key(whole(), "Maximum number of ticks from the request to the resolution.")
_AT = Key(REGION, "Where it is.", required="for example 'region: 47' or 'region: [3, 8]'")


class ObstacleKeys(Table):
    example = "{type: door, region: 47}"
    definition = "obstacle"
    type = Key(TYPE, "An obstacle type of the catalogue.", required="for example 'type: door'")
    region = _AT
    traversable = Key(TRUTH, "What resolving it reveals. Default: true.")
    from_ = Key(TICK, "The tick at which it appears. Default: the first.", name="from")
    until = Key(TICK, "The tick at which it disappears. Default: never.")
    resolve_within = LIMIT


class OrderKeys(Table):
    at = Key(TICK, "The tick at which the team receives it.", required="for example 'at: 10'")
    type = Key(
        TYPE,
        "An obstacle type with 'blocks: []'.",
        required="an obstacle type with 'blocks: []'",
    )
    region = _AT
    resolve_within = LIMIT


OBSTACLES = form(many(ObstacleKeys))
ORDERS = form(many(OrderKeys))


def read_obstacles(node: Node | None, reading: Reading) -> tuple[Obstacle, ...]:
    """Return the readable obstacles; errors in the others are reported."""
    found: list[Obstacle] = []
    for item in ObstacleKeys.each(node, "obstacles", "an obstacle", reading):
        obstacle, where = _read_obstacle(item, reading), item.where(ObstacleKeys.region)
        if obstacle is None:
            continue
        for first in found:
            if first.region != obstacle.region or not _meet(first, obstacle):
                continue
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
    ends = (one.goes or MOST_TICKS, other.goes or MOST_TICKS)
    return max(one.appears or 0, other.appears or 0) < min(ends)


def _read_obstacle(item: ObstacleKeys, reading: Reading) -> Obstacle | None:
    kind = item.type
    label = kind.name if kind else "the obstacle"
    item.of = f"of {label}"
    region = item.region
    before = len(reading)
    truth = _truth(item, kind, reading)
    appears, goes, limit = item.from_, item.until, item.resolve_within
    if appears is not None and goes is not None and appears >= goes:
        hint = "'from' is the tick at which it appears, 'until' that at which it disappears"
        reading.add(item.where(ObstacleKeys.until), f"{label} disappears before it appears", hint)
    if kind is None or region is None or len(reading) > before:
        return None
    return Obstacle(kind, region, truth, appears, goes, limit)


def read_orders(node: Node | None, reading: Reading) -> tuple[Obstacle, ...]:
    """Return the tasks that the team receives during the run, as obstacles that block no robot."""
    found: list[Obstacle] = []
    for item in OrderKeys.each(node, "orders", "an order", reading):
        at, limit, kind, region = item.at, item.resolve_within, item.type, item.region
        if kind is not None and kind.blocks != frozenset():
            message = f"an order of {kind.name}, which stops robots"
            reading.add(item.where(OrderKeys.type), message, f"give {kind.name} 'blocks: []'")
        elif at is not None and kind is not None and region is not None:
            truth = True if kind.has_truth else None
            number = 1 + sum(o.type is kind and o.region == region for o in found)
            found.append(Obstacle(kind, region, truth, at, None, limit, True, number))
    return tuple(found)


def _truth(item: ObstacleKeys, kind: ObstacleType | None, reading: Reading) -> bool | None:
    """Return the truth of an obstacle: traversable by default; None for a type without a truth."""
    stray = item.where(ObstacleKeys.traversable)
    if kind is None or kind.has_truth or stray is None:
        given = item.traversable
        return (given is not False) if kind is not None and kind.has_truth else None
    having = [o.name for o in reading.catalogue.obstacles.values() if o.has_truth]
    hint = f"types that reveal a truth: {', '.join(having)}" if having else ""
    reading.add(stray, f"a {kind.name} has no 'traversable' to reveal", hint)
    return None
