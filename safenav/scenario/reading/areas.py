"""Sets of regions in a scenario: ``areas``, the cells of ``partition``, and ``never_together``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from msgspec.structs import replace

from safenav.scenario import language
from safenav.scenario.reading.regions import Reading
from safenav.scenario.settings import Exclusion
from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Scalar, clipped, items_of, plain
from safenav.scenario.yaml.findings import wrong_type
from safenav.scenario.yaml.typed import Raw, read
from safenav.world.map import Region, RegionMap

_AREA = "a list of regions [[1, 1], [1, 2]], or {rows: 1-4, columns: 1-6}"
_RANGE = re.compile(r"(\d{1,9})\s*-\s*(\d{1,9})", re.ASCII)


def resolve_areas(listed: Mapping[Scalar, language.AreaValue], reading: Reading) -> None:
    """Add the areas of the scenario to ``reading``."""
    areas: dict[str, frozenset[Region] | None] = {}
    for key, value in listed.items():
        name = clipped(key.text)
        if key.text in reading.names:
            reading.add(key, f"'{name}' already names a region", "use another name")
            continue
        area = areas[key.text] = _area(value.node, f"area '{name}'", reading)
        if area and reading.world is not None:
            notes = (*reading.world.notes, *_meant_cell(value.node, name, reading.world))
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
        wrong_type(node, what, _AREA, reading)
    if reading.reports_position(node, what):
        return None
    for item in (node,) if isinstance(node, document.Mapping) else items_of(node):
        if isinstance(item, document.Mapping):
            found |= _rectangle(read(language.RectangleKeys, item, what, reading), what, reading)
        elif (region := reading.region(item, what)) is not None:
            found.add(region)
    if not found and reading.world is not None and len(reading) == before:
        reading.add(node, f"{what} has no free region", f"expected {_AREA}")
    return frozenset(found) if found and len(reading) == before else None


def _rectangle(item: language.RectangleKeys, what: str, reading: Reading) -> set[Region]:
    """Return the free regions of ``{rows: 1-4, columns: 1-6}``; a missing key means all."""
    world = reading.world
    if not item.node.entries:
        reading.add(item.node, f"{what}: a rectangle has 'rows', 'columns' or both")
    rows = _span(item.rows, world.rows if world else None, reading)
    cols = _span(item.columns, world.cols if world else None, reading)
    if world is None or not item.node.entries:
        return set()
    inside = (world.region(row, col) for row in rows for col in cols)
    return {region for region in inside if region not in world.walls}


def _span(span: Raw | None, count: int | None, reading: Reading) -> range:
    if span is None:
        return range(count or 0)
    value = span.node.value if isinstance(span.node, Scalar) else None
    match = _RANGE.fullmatch(value) if isinstance(value, str) else None
    if match is None and (not isinstance(value, int) or isinstance(value, bool)):
        wrong_type(span.node, span.what, "a number or a range such as 1-4", reading)
        return range(0)
    first, last = (int(match[1]), int(match[2])) if match else (int(value or 0),) * 2
    if first > last or first < 0 or (count is not None and last >= count):
        reason = "is empty" if first > last else "reaches outside the map"
        hint = f"they are numbered from 0 to {count - 1}" if count else "they are numbered from 0"
        reading.add(span.node, f"{span.what}: {first}-{last} {reason}", hint)
        return range(0)
    return range(first, last + 1)


def resolve_exclusions(
    listed: Sequence[language.ExclusionKeys], reading: Reading
) -> tuple[Exclusion, ...]:
    """Return the readable exclusions; errors in the others are reported."""
    known, found = {robot.name: robot for robot in reading.team}, []
    for item in listed:
        before, place, where = len(reading), item.at("robots"), item.at("in")
        names = frozenset(word.text for word in item.robots or ())
        for name in sorted(names):
            reading.names_robot(place, name)
        if not item.flawed and len(names) < 2 and len(reading) == before:
            reading.add(place, f"{item.named('robots')}: at least two robots are needed")
        zone = reading.zone(item.in_)
        if isinstance(where, document.Sequence) and not where.items:
            reading.add(where, f"{item.named('in')} is empty", "name at least one region")
        team = [known[name] for name in sorted(names & {*known})]
        together = [robot.name for robot in team if zone and robot.start.region in zone]
        if len(together) > 1:
            reason = f"{together[0]} and {together[1]} both start there"
            reading.add(where, f"{item.named('in')}: {reason}", "let one start elsewhere")
        if len(reading) == before and zone is not None:
            found.append(Exclusion(names, zone))
    return tuple(found)
