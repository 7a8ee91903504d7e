"""The ``map:`` of a scenario: a grid of characters and names for regions."""

from __future__ import annotations

import re
from collections.abc import Sequence as Lines

from safenav.scenario.document import Mapping, Node, Place, Scalar, Sequence, clipped
from safenav.scenario.fields import described, mapping, sequence, wrong_type
from safenav.scenario.findings import Findings
from safenav.scenario.region_reader import RegionReader
from safenav.world.map import FREE, WALL, RegionMap

MAX_REGIONS = 512 * 512

KEYS = ("grid", "names")
FOREIGN_FORMATS = ("image", "ros", "movingai")
"""Map formats of the design that are not read yet."""

_CHARACTERS = frozenset({WALL, FREE})

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")


def read_map(node: Node | None, source: Lines[str], findings: Findings) -> RegionReader:
    """The map with its names; ``source`` are the lines of the file, to find grid rows in.

    If the map cannot be used (which is reported) the reader knows no map, only names.
    """
    fields = mapping(node, "map", findings, (*KEYS, *FOREIGN_FORMATS))
    if fields is None:
        return RegionReader(None, {}, findings)
    foreign = [key for key, _ in fields.entries if key.text in FOREIGN_FORMATS]
    for key in foreign:
        found = f"maps of the form '{key.text}' are not supported yet"
        findings.add(key, found, "draw the map as a 'grid' of '#' and '.'")
    world: RegionMap | None = None
    grid = fields.get("grid")
    if grid is not None:
        world = _read_grid(grid, source, findings)
    elif not foreign:
        hint = "write 'grid: |' and below it one indented line of '#' and '.' for each row"
        findings.add(fields, "map: the key 'grid' is missing", hint)
    return _with_names(world, fields, findings)


def _with_names(world: RegionMap | None, fields: Mapping, findings: Findings) -> RegionReader:
    plain = RegionReader(world, {}, findings)
    names: dict[str, int | None] = {}
    listed = mapping(fields.get("names"), "'names' of map", findings)
    for key, node in listed.entries if listed else ():
        if not NAME.fullmatch(key.text):
            hint = "use letters, digits, '_' and '-', beginning with a letter"
            findings.add(key, f"'{clipped(key.text)}' cannot name a region", hint)
        elif isinstance(node, Scalar) and isinstance(node.value, str):
            wrong_type(node, f"region '{key.text}'", "a number or [row, column]", findings)
            names[key.text] = None
        else:
            names[key.text] = plain.region(node, f"region '{key.text}'")
    if world is None:
        return RegionReader(None, names, findings)
    known = {name: region for name, region in names.items() if region is not None}
    return RegionReader(RegionMap(world.rows, world.cols, world.walls, known), names, findings)


def _read_grid(node: Node, source: Lines[str], findings: Findings) -> RegionMap | None:
    rows = _rows(node, source, findings)
    if rows is None:
        return None
    if not rows or not rows[0][1]:
        hint = "write 'grid: |' and below it one indented line of '#' and '.' for each row"
        findings.add(node, "the grid is empty", hint)
        return None
    before = len(findings)
    cols = len(rows[0][1])
    for number, (place, row) in enumerate(rows):
        if len(row) != cols:
            found = f"ragged map: row {number} has {len(row)} characters, row 0 has {cols}"
            findings.add(place, found, "every row of the grid is equally long")
        if not _CHARACTERS.issuperset(row):
            odd = next(i for i, char in enumerate(row) if char not in _CHARACTERS)
            at = Place(place.line, place.column + odd)
            found = f"row {number}, column {odd} of the map: '{clipped(row[odd])}'"
            findings.add(at, found, "'#' is a wall and '.' is free; there is nothing else")
    if len(rows) * cols > MAX_REGIONS:
        found = f"a map of {len(rows)} x {cols} regions; the most is {MAX_REGIONS} (512 x 512)"
        findings.add(node, found, "use larger regions")
    if len(findings) > before:
        return None
    return RegionMap.from_grid(row for _, row in rows)


def _rows(node: Node, source: Lines[str], findings: Findings) -> list[tuple[Place, str]] | None:
    """The rows of the grid, each with its place in the file. Blanks at their end
    and empty lines around them go."""
    if isinstance(node, Sequence):
        return _listed_rows(node, findings)
    if isinstance(node, Scalar) and node.value is None:
        return []
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, "'grid' of map", "a block of text ('grid: |')", findings)
        return None
    lines = [(index, line.rstrip()) for index, line in enumerate(node.value.split("\n"))]
    while lines and not lines[-1][1]:
        lines.pop()
    while lines and not lines[0][1]:
        lines.pop(0)
    if node.style != "|":
        if any(" " in line for _, line in lines):
            hint = "write 'grid: |' so that line breaks are kept"
            findings.add(node, "the rows of the grid run together", hint)
            return None
        return [(node.place, line) for _, line in lines]
    return [(_row_place(node.place.line + 1 + index, line, source), line) for index, line in lines]


def _row_place(line: int, row: str, source: Lines[str]) -> Place:
    written = source[line - 1].rstrip() if line <= len(source) else row
    return Place(line, len(written) - len(row) + 1)


def _listed_rows(node: Sequence, findings: Findings) -> list[tuple[Place, str]] | None:
    rows = []
    for item in sequence(node, "'grid' of map", findings) or ():
        if not isinstance(item, Scalar) or not isinstance(item.value, str):
            found = f"a row of the grid: found {described(item)}, expected text"
            findings.add(item, found, "quote rows in a list: without quotes '#' is a comment")
            return None
        quote = 1 if item.style in ("'", '"') else 0
        rows.append((Place(item.place.line, item.place.column + quote), item.value.rstrip()))
    return rows
