"""Names of regions and areas on a picture, each inside its own, and outlines of areas.

The page has the same rules (front/src/map/names.tsx), but measures letters in the browser.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from msgspec import Struct

from safenav.report.picture.svg import SvgWriter, number, text_width
from safenav.world.map import Region, RegionMap

AREA = "#0067A3"
_SIZES = (13.0, 12.0, 11.0, 10.0, 9.0)
"""Heights of letters, the best first."""
_LINE = 1.15
_GAP = 2.0
"""Distance of a name from the border of its region."""
_MOST_TRIED = 24
"""Regions in which the name of an area is tried."""


class TextBox(Struct, frozen=True):
    """A rectangle; y grows to the south."""

    left: float
    top: float
    right: float
    bottom: float

    def overlaps(self, other: TextBox) -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )


class PlacedName(Struct, frozen=True):
    """A name with its box, in one or two ``lines``, abbreviated if it has to be."""

    text: str
    lines: tuple[str, ...]
    size: float
    box: TextBox
    area: bool


def placed_names(world: RegionMap, cell: float) -> list[PlacedName]:
    """Return the names of a map with regions of side ``cell``: that of a region at the lower edge
    of the region, that of an area in its middle; those without room are left out."""
    found = (_in_region(world, n, region, cell, False) for n, region in world.names.items())
    names = [name for name in found if name is not None]
    for text, area in world.areas.items():
        free = (
            name
            for name in _of_area(world, text, area, cell)
            if not any(name.box.overlaps(other.box) for other in names)
            and _regions(world, name.box, cell) <= area
        )
        names += [name for name in [next(free, None)] if name is not None]
    return names


def _in_region(
    world: RegionMap, text: str, region: Region, cell: float, area: bool
) -> PlacedName | None:
    fitted = _fitted(text, cell)
    if fitted is None:
        return None
    lines, size = fitted
    row, col = world.position(region)
    wide = max(text_width(line, size, bold=True) for line in lines)
    left, bottom = (col + 0.5) * cell - wide / 2, (row + 1) * cell - _GAP / 2
    box = TextBox(left, bottom - len(lines) * _LINE * size, left + wide, bottom)
    return PlacedName(text, lines, size, box, area)


def _fitted(text: str, side: float) -> tuple[tuple[str, ...], float] | None:
    """Return a text in at most two lines that fit a region, and their size; None if there is no
    room for three letters."""

    def fits(lines: tuple[str, ...], size: float) -> bool:
        wide = max(text_width(line, size, bold=True) for line in lines)
        return wide <= side - 2 * _GAP and len(lines) * _LINE * size <= side

    folds = [(text[: at.end()], text[at.end() :]) for at in re.finditer("[ _-](?=.)", text)]
    short = [(f"{text[:length]}…",) for length in range(len(text) - 1, 2, -1)]
    for lines in ((text,), *folds, *short):
        for size in _SIZES if lines not in short else _SIZES[-1:]:
            if fits(lines, size):
                return lines, size
    return None


def _of_area(
    world: RegionMap, text: str, area: frozenset[Region], cell: float
) -> Iterator[PlacedName]:
    """Yield possible places of the name of an area, the best first."""
    places = [world.position(region) for region in area]
    row, col = (sum(values) / len(places) for values in zip(*places, strict=True))

    def away(region: Region) -> tuple[float, Region]:
        r, c = world.position(region)
        return (r - row) ** 2 + (c - col) ** 2, region

    tried = sorted(area, key=away)[:_MOST_TRIED]
    for size in _SIZES:
        wide, high = text_width(text, size, bold=True) + 2 * _GAP, _LINE * size
        for region in tried:
            r, c = world.position(region)
            left = (c + 0.5) * cell - wide / 2
            for top in ((r + 0.5) * cell - high / 2, r * cell + _GAP):
                box = TextBox(left, top, left + wide, top + high)
                yield PlacedName(text, (text,), size, box, True)
    for region in tried:
        if (name := _in_region(world, text, region, cell, True)) is not None:
            yield name


def _regions(world: RegionMap, box: TextBox, cell: float) -> set[Region]:
    """Return the regions that a box touches; -1: outside of the map."""
    rows = range(int(box.top // cell), int(box.bottom // cell) + 1)
    cols = range(int(box.left // cell), int(box.right // cell) + 1)
    return {
        world.region(row, col) if 0 <= row < world.rows and 0 <= col < world.cols else -1
        for row in rows
        for col in cols
    }


def draw_names(page: SvgWriter, names: list[PlacedName], ink: str) -> None:
    """Draw names with a light outline, so that they are also readable on marks."""
    for name in names:
        for i, line in enumerate(reversed(name.lines)):
            page.text(
                (name.box.left + name.box.right) / 2,
                name.box.bottom - (0.25 + i * _LINE) * name.size,
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
    """Return the outer border of a set of regions, moved inwards by ``inset``."""

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
