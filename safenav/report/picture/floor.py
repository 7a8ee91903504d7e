"""The ground of all pictures: free regions, walls, region numbers and names."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from functools import lru_cache

from msgspec import Struct

from safenav.report.picture.svg import SvgWriter, number, text_width
from safenav.world.map import Region, RegionMap

INK = "#1B1F24"
MUTED = "#5C6470"
WALL, WALL_LINE = "#D3D7DD", "#9AA2AD"
LINES = "#D5D9DF"

_LEGIBLE = 8.0
"""Height of the smallest digits, in units of the picture."""
LEAST_NUMBERED = 28.0
"""Side of the smallest regions with a number."""


def cell_size(world: RegionMap) -> float:
    """Return the side of a region in units of the picture: 48, or less for large maps."""
    return max(14.0, min(48.0, 1150.0 / max(world.cols, world.rows * 1.4)))


@lru_cache(maxsize=1)  # each frame of an animation needs it
def window(world: RegionMap) -> tuple[float, float, float, float]:
    """Return the part of a map in pictures, which ends half a region beyond the free regions: left
    border, upper border, width and height, in regions."""
    free = [world.position(region) for region in world.free] or [(0, 0)]
    rows, cols = [row for row, _ in free], [col for _, col in free]
    left, upper = max(0.0, min(cols) - 0.5), max(0.0, min(rows) - 0.5)
    right, lower = min(world.cols, max(cols) + 1.5), min(world.rows, max(rows) + 1.5)
    return left, upper, right - left, lower - upper


def draw_floor(page: SvgWriter, world: RegionMap, cell: float) -> None:
    """Draw regions and walls. The origin is the north-western corner of the map."""
    width, height = world.cols * cell, world.rows * cell
    page.rect(0, 0, width, height, fill="#FFFFFF", stroke=WALL_LINE, stroke_width=1)
    lines = [f"M0,{number(r * cell)}H{number(width)}" for r in range(1, world.rows)]
    lines += [f"M{number(c * cell)},0V{number(height)}" for c in range(1, world.cols)]
    page.path("".join(lines), stroke=LINES, stroke_width=0.75, fill="none")
    page.path(filled(world, world.walls, cell), fill=WALL)
    page.path(outline(world, world.walls, cell), fill="none", stroke=WALL_LINE, stroke_width=0.75)


def filled(world: RegionMap, regions: Collection[Region], cell: float) -> str:
    """Return a path with a rectangle for each run of regions in a row, to avoid seams."""
    parts, count = [], 0
    for region in sorted(regions):
        row, col = world.position(region)
        count += 1
        if col == world.cols - 1 or region + 1 not in regions:
            left, width = number((col + 1 - count) * cell), number(count * cell)
            parts.append(f"M{left},{number(row * cell)}h{width}v{number(cell)}h-{width}z")
            count = 0
    return "".join(parts)


def draw_numbers(
    page: SvgWriter, world: RegionMap, cell: float, names: Sequence[PlacedName]
) -> None:
    """Draw the number of each free region without a name in its corner. Draw none if numbers of
    neighbours would overlap."""
    size = max(_LEGIBLE, cell * 0.17)
    if cell < max(LEAST_NUMBERED, text_width(f"{world.size - 1} ", size)):
        return
    named = {region for name in names for region in name.regions}
    page.open("g", font_size=number(size), fill="#7A818C")
    for region in world.free:
        if region not in named:
            row, col = world.position(region)
            x, y = (col + 0.07) * cell, row * cell + 0.03 * cell + size
            page.element("text", str(region), x=x, y=y)
    page.close("g")


AREA = "#0067A3"
_MOST, _LEAST = 13.0, 9.0
"""Heights of letters."""
BELOW = 0.19
"""Maximum height of letters, as a share of a region: robots do not hide them."""
_LINE = 1.15
_GAP = 2.0
"""Distance between a name and the border of its regions."""


class PlacedName(Struct, frozen=True):
    """A name in one or two ``lines``, abbreviated if necessary, in ``regions`` of one row. ``x``:
    the middle of the text; ``bottom``: its lower edge."""

    text: str
    lines: tuple[str, ...]
    size: float
    x: float
    bottom: float
    regions: range
    area: bool

    @property
    def top(self) -> float:
        return self.bottom - len(self.lines) * _LINE * self.size


def placed_names(world: RegionMap, cell: float) -> list[PlacedName]:
    """Return the names of a map with regions of side ``cell``, at the lower edges of their regions.
    An area's name is in its longest row. Names without room are omitted."""
    found: list[PlacedName] = []

    def place(text: str, row: range, area: bool) -> None:
        fitted = _fitted(text, len(row) * cell, cell)
        if fitted is None:
            return
        lines, size = fitted
        at, col = world.position(row.start)
        x = (col + len(row) / 2) * cell
        half = max(text_width(line, size, bold=True) for line in lines) / 2
        first, last = (row.start - col + int((x + side) // cell) for side in (-half, half))
        regions = range(first, last + 1)
        found.append(PlacedName(text, lines, size, x, (at + 1) * cell - _GAP / 2, regions, area))

    for text, region in world.names.items():
        place(text, range(region, region + 1), False)
    for text, area in world.areas.items():
        place(text, _longest(world, area.difference(*(name.regions for name in found))), True)
    return found


def _longest(world: RegionMap, regions: Collection[Region]) -> range:
    """Return the longest run of regions in a row (of several, that nearest to the middle)."""
    runs: list[range] = [range(0)]
    for region in sorted(regions):
        joins = runs[-1].stop == region and region % world.cols
        runs.append(range(runs.pop().start if joins else region, region + 1))
    middle = sum(world.position(region)[0] for region in regions) / max(1, len(regions))
    return max(runs, key=lambda run: (len(run), -abs(run.start // world.cols - middle)))


def _fitted(text: str, wide: float, side: float) -> tuple[tuple[str, ...], float] | None:
    """Return a text, in lines that fit into a width and a region of this side, and its size; None
    if three letters do not fit."""
    folds = [(text[: at.end()], text[at.end() :]) for at in re.finditer("[ _-](?=.)", text)]
    short = [(f"{text[:length]}…",) for length in range(len(text) - 1, 2, -1)]
    for lines in ((text,), *folds, *short):
        across = max(text_width(line, 1, bold=True) for line in lines)
        room = min((wide - 2 * _GAP) / across, side / (len(lines) * _LINE))
        if room >= _LEAST:
            return lines, min(room, max(_LEAST, min(_MOST, BELOW * wide)))
    return None


def draw_names(page: SvgWriter, names: list[PlacedName], ink: str) -> None:
    """Draw names with a light outline, readable on top of marks."""
    for name in names:
        for i, line in enumerate(reversed(name.lines)):
            page.text(
                name.x,
                name.bottom - (0.25 + i * _LINE) * name.size,
                line,
                name.size,
                bold=True,
                fill=AREA if name.area else ink,
                stroke="#FFFFFF",
                stroke_width=0.28 * name.size,
                stroke_linejoin="round",
                paint_order="stroke",
                text_anchor="middle",
            )


def draw_areas(page: SvgWriter, world: RegionMap, cell: float) -> None:
    """Draw a dashed line around each area."""
    for area in world.areas.values():
        border = outline(world, area, cell)
        page.path(border, fill="none", stroke=AREA, stroke_width=2, stroke_dasharray="6 3")


def outline(world: RegionMap, regions: frozenset[Region], cell: float, inset: float = 0.0) -> str:
    """Return the outer border of a set of regions as a path, moved inwards by ``inset``."""

    def has(row: int, col: int) -> bool:
        inside = 0 <= row < world.rows and 0 <= col < world.cols
        return inside and world.region(row, col) in regions

    def end(beside: bool, corner: bool) -> float:
        return inset if not beside else -inset if corner else 0.0

    parts = []
    for region in sorted(regions):
        row, col = world.position(region)
        for side in (-1, 1):
            if not has(row + side, col):
                y = (row + (side + 1) / 2) * cell - side * inset
                left = col * cell + end(has(row, col - 1), has(row + side, col - 1))
                right = (col + 1) * cell - end(has(row, col + 1), has(row + side, col + 1))
                parts.append(f"M{number(left)},{number(y)}H{number(right)}")
            if not has(row, col + side):
                x = (col + (side + 1) / 2) * cell - side * inset
                top = row * cell + end(has(row - 1, col), has(row - 1, col + side))
                bottom = (row + 1) * cell - end(has(row + 1, col), has(row + 1, col + side))
                parts.append(f"M{number(x)},{number(top)}V{number(bottom)}")
    return "".join(parts)
