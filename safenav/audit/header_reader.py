"""The first line of a trace: the scenario as it was run."""

from __future__ import annotations

from safenav.audit.fields import Fields
from safenav.audit.records import Header, ObstacleHeader, RobotHeader


def header_of(number: int, fields: Fields) -> Header:
    """The header on line ``number``; what is wrong with it is in ``fields.problems``."""
    scenario = fields.inner("scenario")
    world = scenario.inner("map")
    until, limits = scenario.inner("until"), scenario.inner("limits")
    obstacles = {}
    for entry in scenario.inner_list("obstacles"):
        obstacle = obstacle_of(number, entry)
        if obstacle.name in obstacles:
            fields.problems.append(f"two obstacles are named {obstacle.name}")
        obstacles[obstacle.name] = obstacle
    return Header(
        line=number,
        safenav=fields.text("safenav"),
        name=scenario.text("name"),
        rows=world.count("rows"),
        cols=world.count("cols"),
        grid=world.texts("grid"),
        robots={name: _robot(name, entry) for name, entry in scenario.inner_each("robots").items()},
        obstacles=obstacles,
        until_rounds=until.count("rounds") if until.has("rounds") else None,
        limit_ticks=limits.count("ticks") if limits.has("ticks") else None,
        seed=scenario.integer("seed"),
        coordination=scenario.text("coordination"),
        resolution=_pair(world, "resolution"),
        origin=_triple(world, "origin"),
        external=scenario.has("world") and scenario.text("world") == "external",
    )


def _pair(fields: Fields, key: str) -> tuple[float, float] | None:
    if not fields.has(key):
        return None
    first, second = fields.numbers(key, 2)
    return first, second


def _triple(fields: Fields, key: str) -> tuple[float, float, float] | None:
    if not fields.has(key):
        return None
    first, second, third = fields.numbers(key, 3)
    return first, second, third


def _robot(name: str, fields: Fields) -> RobotHeader:
    return RobotHeader(
        name=name,
        model=fields.text("model"),
        mobility=fields.text("mobility"),
        layer=fields.text("layer"),
        capabilities=frozenset(fields.texts("capabilities")),
        start=fields.integer("start"),
        heading=fields.heading_or_null("heading"),
        objective=fields.objective("objective"),
        conflicts=frozenset(fields.texts("conflicts")) if fields.has("conflicts") else None,
        vision=fields.number_or_null("vision") if fields.has("vision") else None,
        motion=fields.object_or_null("motion") if fields.has("motion") else None,
    )


def obstacle_of(line: int, fields: Fields) -> ObstacleHeader:
    """An obstacle as it stands in a header, or where it is discovered."""
    return ObstacleHeader(
        name=fields.text("name"),
        type=fields.text("type"),
        region=fields.integer("region"),
        action=fields.text("action"),
        resolution_regions=fields.regions("resolution_regions"),
        blocks=frozenset(fields.texts("blocks")),
        traversable=fields.flag_or_null("traversable"),
        line=line,
    )
