"""The ``obstacles:`` of a scenario: the hidden ones, found only when a robot meets them."""

from __future__ import annotations

from collections.abc import Sequence

from safenav.scenario.model import Catalogue, Obstacle, ObstacleType, Robot
from safenav.scenario.reading.catalogue import RESOLVE_WITHIN, swept
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, suggestion

PROBABILITY = {"probability": "from 0 to 1, for example {probability: 0.5}"}
SUSPECT_KEYS = ("type", "region")
KEYS = ("type", "region", "traversable", "from", "until", RESOLVE_WITHIN, "sweeps")
ORDER_KEYS = ("at", "type", "region", RESOLVE_WITHIN)
ORDER_REQUIRED = {
    "at": "the tick at which the team receives it, for example 'at: 10'",
    "type": "an obstacle type with 'blocks: []'",
    "region": "where it is, for example 'region: 47' or 'region: [3, 8]'",
}
MOST_TICKS = 2**31
REQUIRED = {
    "type": "an obstacle type of the catalogue, for example 'type: door'",
    "region": "where it is, for example 'region: 47' or 'region: [3, 8]'",
}


def read_obstacles(
    node: Node | None,
    regions: RegionReader,
    catalogue: Catalogue,
    robots: Sequence[Robot],
    findings: Findings,
) -> tuple[Obstacle, ...]:
    """The obstacles that could be read; what is wrong with the others is reported."""
    found: list[Obstacle] = []
    for item in read.sequence(node, "obstacles", findings) or ():
        obstacle = _read_obstacle(item, regions, catalogue, findings)
        if obstacle is None:
            continue
        for first in found:
            if first.region != obstacle.region or not _meet(first, obstacle):
                continue
            message = f"{obstacle.name}: the region already contains {first.name}"
            findings.add(_where(item), message, "a region holds one hidden obstacle")
            break
        else:
            found.append(obstacle)
        for robot in robots:
            if obstacle.appears is not None:
                break  # it waits until nobody stands there
            if robot.start.region == obstacle.region and obstacle.closed_to(robot):
                message = f"{obstacle.name} is where {robot.name} starts, and blocks it"
                findings.add(_where(item), message, _apart(obstacle, robot))
    return tuple(found)


def _apart(obstacle: Obstacle, robot: Robot) -> str:
    """The hint for a robot that starts inside an obstacle."""
    if any(need.action in robot.capabilities for need in obstacle.needs):
        return f"move one of them: {robot.name} alone does not resolve it from inside"
    return "move one of them"


def _meet(one: Obstacle, other: Obstacle) -> bool:
    """Whether both are there in some tick."""
    ends = (one.goes or MOST_TICKS, other.goes or MOST_TICKS)
    return max(one.appears or 0, other.appears or 0) < min(ends)


def _read_obstacle(
    node: Node, regions: RegionReader, catalogue: Catalogue, findings: Findings
) -> Obstacle | None:
    item = read.mapping(node, "an obstacle", findings, KEYS, REQUIRED)
    if item is None:
        return None
    kind = _type(item.get("type"), catalogue, findings)
    label = kind.name if kind else "the obstacle"
    region = regions.region(item.get("region"), f"'region' of {label}")
    before = len(findings)
    truth = _truth(item.get("traversable"), kind, catalogue, findings)
    appears, goes = (
        read.integer(item.get(word), f"'{word}' of {label}", findings, least=1, most=MOST_TICKS)
        for word in ("from", "until")
    )
    limit = read.integer(item.get(RESOLVE_WITHIN), f"'{RESOLVE_WITHIN}' of {label}", findings)
    several = kind is not None and bool(kind.listed)
    sweeps = swept(item.get("sweeps"), label, several, regions, findings)
    if appears is not None and goes is not None and appears >= goes:
        hint = "'from' is the tick at which it appears, 'until' that at which it goes"
        findings.add(item.get("until") or node, f"{label} goes before it appears", hint)
    if kind is None or region is None or len(findings) > before:
        return None
    return Obstacle(kind, region, truth, appears, goes, limit, sweeps=sweeps)


def read_orders(
    node: Node | None, regions: RegionReader, catalogue: Catalogue, findings: Findings
) -> tuple[Obstacle, ...]:
    """Work that the team receives at some tick, as obstacles that are in no robot's way."""
    found: list[Obstacle] = []
    for part in read.sequence(node, "orders", findings) or ():
        item = read.mapping(part, "an order", findings, ORDER_KEYS, ORDER_REQUIRED)
        if item is None:
            continue
        at = read.integer(item.get("at"), "'at' of an order", findings, least=1, most=MOST_TICKS)
        kind = _type(item.get("type"), catalogue, findings)
        region = regions.region(item.get("region"), "'region' of an order")
        limit = read.integer(item.get(RESOLVE_WITHIN), f"'{RESOLVE_WITHIN}' of an order", findings)
        if kind is not None and kind.blocks != frozenset():
            said = f"an order of {kind.name}, which stops robots"
            findings.add(item.get("type"), said, f"give {kind.name} 'blocks: []'")
        elif at is not None and kind is not None and region is not None:
            truth = True if kind.has_truth else None
            number = 1 + sum(o.type is kind and o.region == region for o in found)
            found.append(Obstacle(kind, region, truth, at, None, limit, True, number))
    return tuple(found)


def read_suspects(
    node: Node | None, regions: RegionReader, catalogue: Catalogue, findings: Findings
) -> tuple[Obstacle, ...] | None:
    """The obstacles of which the team knows that they may be there; None without a list."""
    items = read.sequence(node, "suspects", findings)
    if items is None:
        return None
    found = []
    for item in items:
        if read.mapping(item, "a suspect", findings, SUSPECT_KEYS, REQUIRED) is None:
            continue
        assert isinstance(item, Mapping)
        kind = _type(item.get("type"), catalogue, findings)
        region = regions.region(item.get("region"), "'region' of a suspect")
        if kind is not None and region is not None:
            found.append(Obstacle(kind, region))
    return tuple(found)


def _type(node: Node | None, catalogue: Catalogue, findings: Findings) -> ObstacleType | None:
    word = read.text(node, "'type' of an obstacle", findings)
    if word is None:
        return None
    kind = catalogue.obstacles.get(word)
    if kind is None and not catalogue.may_hold(word):
        hint = suggestion(word, catalogue.obstacles)
        findings.add(node, f"unknown obstacle type '{clipped(word)}'", hint)
    return kind


def _truth(
    node: Node | None, kind: ObstacleType | None, catalogue: Catalogue, findings: Findings
) -> bool | float | None:
    """Its truth: traversable unless the scenario says otherwise."""
    if node is None:
        return True if kind is not None and kind.has_truth else None
    if kind is not None and not kind.has_truth:
        having = [other.name for other in catalogue.obstacles.values() if other.has_truth]
        hint = f"types that reveal a truth: {', '.join(having)}" if having else ""
        findings.add(node, f"a {kind.name} has no 'traversable' to reveal", hint)
        return None
    if isinstance(node, Mapping):
        item = read.mapping(node, "'traversable'", findings, ("probability",), PROBABILITY)
        value = item.get("probability") if item else None
        return read.probability(value, "'probability' of traversable", findings)
    if isinstance(node, Scalar) and isinstance(node.value, bool):
        return node.value
    read.wrong_type(node, "'traversable'", "true, false or {probability: 0.5}", findings)
    return None


def _where(node: Node) -> Node:
    """The region of an obstacle, to point at."""
    region = node.get("region") if isinstance(node, Mapping) else None
    return region or node
