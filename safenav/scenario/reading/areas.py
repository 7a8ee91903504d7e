"""Sets of regions in a scenario: ``areas``, the cells of ``partition``, and ``never_together``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import ClassVar

from msgspec.structs import replace

from safenav.scenario.model import Tracking
from safenav.scenario.reading.regions import REGION, TARGET, Reading
from safenav.scenario.settings import Exclusion
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped, items_of, plain
from safenav.scenario.yaml.fields import NAME, well_named
from safenav.scenario.yaml.shapes import Key, Shape, Table
from safenav.world.map import Region, RegionMap
from safenav.world.partition import tiles

_AREA = "a list of regions [[1, 1], [1, 2]], or {rows: 1-4, columns: 1-6}"
_LISTED = {"any": "an area lists its regions: [[1, 1], [1, 2]]"}
_RANGE = re.compile(r"(\d{1,9})\s*-\s*(\d{1,9})", re.ASCII)
_ROOMS = "rooms"
_PARTITION = "'rooms' or {tiles: [rows, columns]}"

SPAN = shapes.form(
    shapes.either(shapes.whole(), shapes.matching(_RANGE)),
    "span",
    "A row or column, or a range of them.",
)


class RectangleKeys(Table):
    about = "The free regions of these rows and columns, from 0 in the north-west."
    definition = "rectangle"
    rules: ClassVar = {"minProperties": 1}
    rows = Key(SPAN, "Default: all rows.")
    columns = Key(SPAN, "Default: all columns.")


class TileKeys(Table):
    tiles = Key(
        shapes.form(shapes.several(shapes.whole(1), shapes.whole(1))),
        "Rows and columns of a tile.",
        required="for example {tiles: [4, 4]}",
    )


class ExclusionKeys(Table):
    example = "{robots: [quad, digit], in: [47]}"
    robots = Key(
        Shape(shapes.many(shapes.TEXT, 2), read.words),
        "At least two robots.",
        required="name two robots or more, for example 'robots: [quad, digit]'",
    )
    in_ = Key(
        shapes.form(shapes.either(TARGET, shapes.many(TARGET, 1))),
        "Regions for at most one of them.",
        required="name regions or areas, for example 'in: bridge'",
        name="in",
    )


AREA = shapes.form(
    shapes.either(RectangleKeys, shapes.many(shapes.either(REGION, RectangleKeys), 1)), "area"
)
AREAS = shapes.form(shapes.named(AREA, shapes.matching(NAME)))


def read_areas(node: Node | None, reading: Reading) -> None:
    """Read the areas of the scenario."""
    areas: dict[str, frozenset[Region] | None] = {}
    listed = read.mapping(node, "'areas'", reading)
    for key, value in listed.entries if listed else ():
        name = clipped(key.text)
        if not well_named(key, "an area", reading):
            continue
        if key.text in reading.names:
            reading.add(key, f"'{name}' already names a region", "use another name")
        else:
            areas[key.text] = _area(value, f"area '{name}'", reading)
            if areas[key.text] and reading.world is not None:
                notes = (*reading.world.notes, *_meant_cell(value, name, reading.world))
                reading.world = replace(reading.world, notes=notes)
    reading.areas = areas
    if reading.world is not None:
        known = {name: area for name, area in areas.items() if area is not None}
        reading.world = replace(reading.world, areas=known)


def _meant_cell(node: Node, name: str, world: RegionMap) -> Iterator[str]:
    """Warn of two regions that are not adjacent: they are probably one region's row and column."""
    match plain(node):
        case [int(one), int(other)] if other not in (one, *world.neighbours(one)):
            if one < world.rows and other < world.cols and world.is_free(world.region(one, other)):
                yield (
                    f"area '{name}' is the regions {one} and {other}, which are not adjacent; "
                    f"the region in row {one}, column {other} alone is written [[{one}, {other}]]"
                )


def _area(node: Node, what: str, reading: Reading) -> frozenset[Region] | None:
    """Return the free regions of an area; None if something was reported."""
    before = len(reading)
    found: set[Region] = set()
    if isinstance(node, Scalar):
        read.wrong_type(node, what, _AREA, reading)
    if reading.reports_position(node, what):
        return None
    for item in (node,) if isinstance(node, Mapping) else items_of(node):
        if isinstance(item, Mapping):
            found |= _rectangle(item, what, reading)
        elif (region := reading.region(item, what)) is not None:
            found.add(region)
    if not found and reading.world is not None and len(reading) == before:
        reading.add(node, f"{what} has no free region", f"expected {_AREA}")
    return frozenset(found) if found and len(reading) == before else None


def _rectangle(node: Mapping, what: str, reading: Reading) -> set[Region]:
    """Return the free regions of ``{rows: 1-4, columns: 1-6}``; a missing key means all."""
    world = reading.world
    item = RectangleKeys.read(node, what, reading, elsewhere=_LISTED)
    if not node.entries:
        reading.add(node, f"{what}: a rectangle has 'rows', 'columns' or both")
    height, width = (world.rows, world.cols) if world else (None, None)
    rows = _span(item.rows if item else None, f"'rows' of {what}", height, reading)
    cols = _span(item.columns if item else None, f"'columns' of {what}", width, reading)
    if world is None or not node.entries:
        return set()
    inside = (world.region(row, col) for row in rows for col in cols)
    return {region for region in inside if region not in world.walls}


def _span(node: Node | None, what: str, count: int | None, reading: Reading) -> range:
    if node is None:
        return range(count or 0)
    value = node.value if isinstance(node, Scalar) else None
    match = _RANGE.fullmatch(value) if isinstance(value, str) else None
    if match is None and (not isinstance(value, int) or isinstance(value, bool)):
        read.wrong_type(node, what, "a number or a range such as 1-4", reading)
        return range(0)
    first, last = (int(match[1]), int(match[2])) if match else (int(value or 0),) * 2
    if first > last or first < 0 or (count is not None and last >= count):
        reason = "is empty" if first > last else "reaches outside the map"
        hint = f"they are numbered from 0 to {count - 1}" if count else "they are numbered from 0"
        reading.add(node, f"{what}: {first}-{last} {reason}", hint)
        return range(0)
    return range(first, last + 1)


def _partition(
    node: Node | None, what: str, reading: Reading
) -> tuple[frozenset[Region], ...] | None:
    """Return the cells; None for the rooms of the map, or if something was reported."""
    if isinstance(node, Mapping):
        return _tiles(node, reading)
    if not isinstance(node, Scalar) or node.value != _ROOMS:
        read.wrong_type(node, what, _PARTITION, reading)
    return None


def _tiles(node: Mapping, reading: Reading) -> tuple[frozenset[Region], ...] | None:
    what = "'tiles' of partition"
    item = TileKeys.read(node, "'partition'", reading)
    sides = item.tiles if item else None
    if not isinstance(sides, Sequence) or len(sides.items) != 2:
        read.wrong_type(sides, what, "[rows, columns]", reading)
        return None
    height, width = (
        read.integer(side, f"{word} in {what}", reading, least=1)
        for side, word in zip(sides.items, ("rows", "columns"), strict=True)
    )
    if height is None or width is None or reading.world is None:
        return None
    return tiles(reading.world, height, width).cells


PARTITION = Shape(
    shapes.either({"const": _ROOMS}, TileKeys),
    _partition,
    "partition",
    "The cells in which a robot out of sight may be. Default: rooms.",
)


def _exclusions(node: Node | None, _what: str, reading: Reading) -> tuple[Exclusion, ...]:
    """Return the readable exclusions; errors in the others are reported."""
    known, found = {robot.name: robot for robot in reading.team}, []
    what = "never_together"
    for item in ExclusionKeys.each(node, what, f"an entry of {what}", reading, f"of {what}"):
        before, place, where = len(reading), item.where(ExclusionKeys.robots), item.in_
        names = item.robots or frozenset()
        for name in sorted(names):
            reading.names_robot(place, name)
        if place is not None and len(names) < 2 and len(reading) == before:
            reading.add(place, f"'robots' of {what}: at least two robots are needed")
        there = f"'in' of {what}"
        zone = reading.zone(where, there)
        if isinstance(where, Sequence) and not where.items:
            reading.add(where, f"{there} is empty", "name at least one region")
        team = [known[name] for name in sorted(names & {*known})]
        together = [robot.name for robot in team if zone and robot.start.region in zone]
        if len(together) > 1:
            reason = f"{together[0]} and {together[1]} both start there"
            reading.add(where, f"{there}: {reason}", "let one start elsewhere")
        for robot in team:
            if robot.tracking is not Tracking.NEARBY:
                reason = f"'tracking: {robot.tracking.value}' of {robot.name}"
                hint = "leave it out: 'tracking: nearby' observes which regions are occupied"
                reading.add(place, f"{what} does not work with {reason}", hint)
        if len(reading) == before and zone is not None:
            found.append(Exclusion(names, zone))
    return tuple(found)


NEVER_TOGETHER = Shape(shapes.many(ExclusionKeys), _exclusions)
