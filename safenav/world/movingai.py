"""Maps of the MovingAI benchmarks (Sturtevant 2012, "Benchmarks for grid-based pathfinding").

The file gives ``type octile``, ``height`` and ``width``, then ``map`` and the rows. A robot walks
on ground (``.`` and ``G``) and through swamp (``S``). In maps of the League of Robot Runners ``E``
(emitter) and ``S`` (service point) are free, too. Trees (``T``), cells out of bounds (``@`` and
``O``) and water (``W``, which cannot be entered from land) are walls.
"""

from __future__ import annotations

import re

from safenav.world.image import Flaw, MapFileError

FREE = frozenset(".GSE")
WALLS = frozenset("@OTW")

_KINDS = ("octile", "tile")
_NUMBER = re.compile(r"[0-9]{1,6}", re.ASCII)
_HEADER = "the file begins with 'type octile', 'height', 'width' and 'map', each on a line"


def read_movingai(text: str) -> list[list[bool]]:
    """Rows from the top, true where there is a wall. Raises MapFileError with all flaws."""
    lines = text.splitlines()
    sizes, begin, flaws = _header(lines)
    rows = [line.rstrip() for line in lines[begin:]]
    while rows and not rows[-1]:
        rows.pop()
    height, width = sizes.get("height"), sizes.get("width")
    for index, row in enumerate(rows):
        flaws += _row_flaws(row, begin + index + 1, width)
    if height is not None and len(rows) != height:
        found = f"{len(rows)} rows where the header announces {height}"
        flaws.append(Flaw(found, "check 'height'", len(lines) if len(rows) < height else begin, 1))
    if flaws:
        raise MapFileError(*flaws)
    return [[char in WALLS for char in row] for row in rows]


def _header(lines: list[str]) -> tuple[dict[str, int], int, list[Flaw]]:
    """Height and width, the index of the first row, and the flaws."""
    sizes: dict[str, int] = {}
    flaws = []
    for index, line in enumerate(lines):
        word, _, value = line.strip().partition(" ")
        value = value.strip()
        if word == "map" and not value:
            flaws += [
                Flaw(f"'{size}' is missing", _HEADER, index + 1, 1)
                for size in ("height", "width")
                if size not in sizes
            ]
            return sizes, index + 1, flaws
        if word in ("height", "width"):
            if _NUMBER.fullmatch(value) and int(value) > 0:
                sizes[word] = int(value)
            else:
                sizes[word] = 0
                flaws.append(Flaw(f"'{word}' is not a size: '{value[:20]}'", "", index + 1, 1))
        elif word == "type":
            if value not in _KINDS:
                found = f"maps of the type '{value[:20]}'"
                flaws.append(Flaw(found, f"known: {', '.join(_KINDS)}", index + 1, 1))
        elif word:
            raise MapFileError(*flaws, Flaw(f"'{line.strip()[:40]}'", _HEADER, index + 1, 1))
    raise MapFileError(*flaws, Flaw("the line 'map' is missing", _HEADER, 1, 1))


def _row_flaws(row: str, line: int, width: int | None) -> list[Flaw]:
    flaws = []
    odd = next((i for i, char in enumerate(row) if char not in FREE and char not in WALLS), None)
    if odd is not None:
        shown = row[odd] if row[odd].isprintable() else "?"
        known = " ".join(sorted(FREE | WALLS))
        flaws.append(Flaw(f"'{shown}' is not a terrain", f"known: {known}", line, odd + 1))
    if width and len(row) != width:
        found = f"a row of {len(row)} characters where the header announces {width}"
        flaws.append(Flaw(found, "check 'width'", line, 1))
    return flaws
