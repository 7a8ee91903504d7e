"""Maps in a scenario itself: rows of characters (``grid``), their size and origin in metres."""

from __future__ import annotations

from safenav.scenario.yaml.document import Node, Place, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, described, wrong_type
from safenav.scenario.yaml.typed import read, sequence
from safenav.world.map import FREE, MAX_REGIONS, WALL, RegionMap

_CHARACTERS = frozenset({WALL, FREE})


def read_grid(node: Node, findings: Findings) -> RegionMap | None:
    """Return the map in a ``grid``; None after an error was reported."""
    rows = _rows(node, findings)
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
        findings.add(node, *too_large(len(rows), cols))
    if len(findings) > before:
        return None
    return RegionMap.from_grid(row for _, row in rows)


def too_large(rows: int, cols: int) -> tuple[str, str]:
    """Return the error for a map of this size, with a hint."""
    found = f"a map of {rows} x {cols} regions; the maximum is {MAX_REGIONS} (512 x 512)"
    return found, "use larger regions"


def _rows(node: Node, findings: Findings) -> list[tuple[Place, str]] | None:
    """Return the rows of the grid, each with its place in the file, without trailing blanks and
    surrounding empty lines."""
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
    return [
        (_row_place(node.place.line + 1 + index, line, findings), line) for index, line in lines
    ]


def _row_place(line: int, row: str, findings: Findings) -> Place:
    written = findings.lines[line - 1].rstrip() if line <= len(findings.lines) else row
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


NO_SIZE = "map: region size missing"
"""The error of a map file that the scenario does not divide."""


def read_origin(
    node: Node | None, what: str, findings: Findings
) -> tuple[float, float, float] | None:
    """Return x, y (metres) and yaw (radians) from ``[x, y]`` or ``[x, y, yaw]``; None if missing or
    reported."""
    if not isinstance(node, Sequence) or len(node.items) not in (2, 3):
        wrong_type(node, what, "[x, y] or [x, y, yaw]", findings)
        return None
    for item in node.items:
        if isinstance(item, Scalar) and str(item.value).lower().strip("+-.") == "nan":
            hint = "write 0: map_saver writes nan or -nan where SLAM gave no valid rotation"
            findings.add(
                item, f"an item of {what}: found the text '{item.value}', expected a number", hint
            )
            return None
    numbers = [read(float, item, f"an item of {what}", findings) for item in node.items]
    x, y, yaw = (*numbers, 0.0)[:3]
    return None if x is None or y is None or yaw is None else (x, y, yaw)
