"""The ``areas:`` of a scenario: named sets of regions, usable wherever a target is."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import ClassVar

from msgspec.structs import replace

from safenav.scenario.reading.naming import NAME, well_named
from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped, plain
from safenav.scenario.yaml.shapes import Key, Table, either, form, many, matching, named, whole
from safenav.world.map import Region, RegionMap

_EXPECTED = "a list of regions [[1, 1], [1, 2]], or {rows: 1-4, columns: 1-6}"
_LISTED = {"any": "an area lists its regions: [[1, 1], [1, 2]]"}
_RANGE = re.compile(r"(\d{1,9})\s*-\s*(\d{1,9})", re.ASCII)

SPAN = form(either(whole(), matching(_RANGE)), "span", "A row or column, or a range of them.")


class RectangleKeys(Table):
    about = "The free regions of these rows and columns, from 0 in the north-west."
    definition = "rectangle"
    rules: ClassVar = {"minProperties": 1}
    rows = Key(SPAN, "Default: all rows.")
    columns = Key(SPAN, "Default: all columns.")


AREA = form(either(RectangleKeys, many(either(REGION, RectangleKeys), 1)), "area")
AREAS = form(named(AREA, matching(NAME)))


def read_areas(node: Node | None, reading: Reading) -> None:
    """Add the areas of the scenario to those of its map."""
    areas = dict(reading.areas)
    listed = read.mapping(node, "'areas'", reading)
    for key, value in listed.entries if listed else ():
        name = clipped(key.text)
        if not well_named(key, "an area", reading):
            continue
        if key.text in reading.names or key.text in reading.areas:
            other = "a region" if key.text in reading.names else "an area of the map's legend"
            reading.add(key, f"'{name}' already names {other}", "use another name")
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
    if not isinstance(node, Sequence | Mapping):
        read.wrong_type(node, what, _EXPECTED, reading)
    if reading.reports_position(node, what):
        return None
    for item in node.items if isinstance(node, Sequence) else (node,):
        if isinstance(item, Mapping):
            found |= _rectangle(item, what, reading)
        elif isinstance(node, Sequence):
            region = reading.region(item, what)
            found |= set() if region is None else {region}
    if not found and reading.world is not None and len(reading) == before:
        reading.add(node, f"{what} has no free region", f"expected {_EXPECTED}")
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
