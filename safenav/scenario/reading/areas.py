"""The ``areas:`` of a scenario: named sets of regions, usable wherever a target is."""

from __future__ import annotations

import re
from typing import ClassVar

from msgspec.structs import replace

from safenav.scenario.reading.naming import NAME
from safenav.scenario.reading.regions import REGION, RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.shapes import Key, Table, either, form, many, matching, named, whole
from safenav.world.map import Region

_EXPECTED = "a list of regions [[1, 1], [1, 2]], or {rows: 1-4, columns: 1-6}"
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


def read_areas(node: Node | None, regions: RegionReader, findings: Findings) -> RegionReader:
    """The reader of regions with the areas that the scenario adds to those of its map."""
    areas = dict(regions.areas)
    listed = read.mapping(node, "'areas'", findings)
    for key, value in listed.entries if listed else ():
        name = clipped(key.text)
        if not NAME.fullmatch(key.text):
            hint = "use letters, digits, '_' and '-', beginning with a letter"
            findings.add(key, f"'{name}' cannot name an area", hint)
        elif key.text in regions.names or key.text in regions.areas:
            other = "a region" if key.text in regions.names else "an area of the map's legend"
            findings.add(key, f"'{name}' already names {other}", "use another name")
        else:
            areas[key.text] = _area(value, f"area '{name}'", regions, findings)
    world = regions.world
    if world is not None:
        known = {name: area for name, area in areas.items() if area is not None}
        world = replace(world, areas=known)
    return RegionReader(world, regions.names, findings, areas)


def _area(
    node: Node, what: str, regions: RegionReader, findings: Findings
) -> frozenset[Region] | None:
    """The free regions of an area; None if something was reported."""
    before = len(findings)
    found: set[Region] = set()
    if not isinstance(node, Sequence | Mapping):
        read.wrong_type(node, what, _EXPECTED, findings)
    for item in node.items if isinstance(node, Sequence) else (node,):
        if isinstance(item, Mapping):
            found |= _rectangle(item, what, regions, findings)
        elif isinstance(node, Sequence):
            region = regions.region(item, what)
            found |= set() if region is None else {region}
    if not found and regions.world is not None and len(findings) == before:
        findings.add(node, f"{what} has no free region", f"expected {_EXPECTED}")
    return frozenset(found) if len(findings) == before else None


def _rectangle(node: Mapping, what: str, regions: RegionReader, findings: Findings) -> set[Region]:
    """The free regions of ``{rows: 1-4, columns: 1-6}``; all rows or columns without the key."""
    world = regions.world
    item = RectangleKeys.read(node, what, findings)
    if item is not None and not node.entries:
        findings.add(node, f"{what}: a rectangle has 'rows', 'columns' or both")
    height, width = (world.rows, world.cols) if world else (None, None)
    rows = _span(item.rows if item else None, f"'rows' of {what}", height, findings)
    cols = _span(item.columns if item else None, f"'columns' of {what}", width, findings)
    if world is None or not node.entries:
        return set()
    inside = (world.region(row, col) for row in rows for col in cols)
    return {region for region in inside if region not in world.walls}


def _span(node: Node | None, what: str, count: int | None, findings: Findings) -> range:
    if node is None:
        return range(count or 0)
    value = node.value if isinstance(node, Scalar) else None
    match = _RANGE.fullmatch(value) if isinstance(value, str) else None
    if match is None and (not isinstance(value, int) or isinstance(value, bool)):
        read.wrong_type(node, what, "a number or a range such as 1-4", findings)
        return range(0)
    first, last = (int(match[1]), int(match[2])) if match else (int(value or 0),) * 2
    if first > last or first < 0 or (count is not None and last >= count):
        reason = "is empty" if first > last else "reaches outside the map"
        hint = f"they are numbered from 0 to {count - 1}" if count else "they are numbered from 0"
        findings.add(node, f"{what}: {first}-{last} {reason}", hint)
        return range(0)
    return range(first, last + 1)
