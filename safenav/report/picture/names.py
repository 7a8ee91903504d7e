"""Names of regions and areas on a picture, placed without overlaps, and outlines of areas.

The page has the same rules (front/src/map/names.tsx), but measures letters in the browser.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from safenav.report.picture.svg import SvgWriter, number, text_width
from safenav.world.map import Region, RegionMap

AREA = "#0067A3"
_SIZES = (13.0, 12.0, 11.0, 10.0, 9.0)
"""Heights of letters; the first one for which a name has room is used."""
_LINE = 1.2
_GAP = 2.0
_BODY = 0.3
"""Half the side, in cells, of the central part of a named region, where robots are drawn."""
_MOST_BOXES = 24


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
    """A name with its box."""

    text: str
    size: float
    box: TextBox
    area: bool


def placed_names(world: RegionMap, cell: float) -> list[PlacedName]:
    """Return the names of a map with regions of side ``cell``; those without room are left out."""
    width, height, inset = world.cols * cell, world.rows * cell, (0.5 - _BODY) * cell
    cells = {name: _cell(world, region, cell) for name, region in world.names.items()}
    bodies = [
        TextBox(box.left + inset, box.top + inset, box.right - inset, box.bottom - inset)
        for box in cells.values()
    ]
    names: list[PlacedName] = []

    def place(text: str, boxes: list[TextBox], area: bool) -> None:
        """Place a name where it covers the fewest robots, in the largest letters that fit."""
        for size in _SIZES:
            wide, high = text_width(text, size, bold=True) + _GAP, _LINE * size
            options: list[tuple[float, TextBox]] = []
            for box in boxes if wide <= width and high <= height else ():
                for x, y in _places(box, wide, high, area):
                    left = min(max(x - wide / 2, 0.0), width - wide)
                    top = min(max(y - high / 2, 0.0), height - high)
                    found = TextBox(left, top, left + wide, top + high)
                    if not any(found.overlaps(name.box) for name in names):
                        below = sum(found.overlaps(body) for body in bodies)
                        options.append((below + 0.1 * len(options), found))
            if options:
                best = min(options, key=lambda option: option[0])[1]
                names.append(PlacedName(text, size, best, area))
                return

    for name, box in cells.items():
        place(name, [box], False)
    for name, regions in world.areas.items():
        place(name, _middle_first(world, regions, cell), True)
    return names


def _cell(world: RegionMap, region: Region, cell: float) -> TextBox:
    row, col = world.position(region)
    return TextBox(col * cell, row * cell, (col + 1) * cell, (row + 1) * cell)


def _middle_first(world: RegionMap, area: frozenset[Region], cell: float) -> list[TextBox]:
    places = [world.position(region) for region in area]
    row, col = (sum(values) / len(places) for values in zip(*places, strict=True))

    def away(region: Region) -> tuple[float, Region]:
        r, c = world.position(region)
        return (r - row) ** 2 + (c - col) ** 2, region

    return [_cell(world, region, cell) for region in sorted(area, key=away)[:_MOST_BOXES]]


def _places(box: TextBox, width: float, height: float, area: bool) -> Iterator[tuple[float, float]]:
    """Yield possible centres of a text for a box: inside at the bottom, below, above, beside it,
    and diagonally."""
    x, y = (box.left + box.right) / 2, (box.top + box.bottom) / 2
    below, above = box.bottom + height / 2, box.top - height / 2
    if area:
        yield x, y
    yield x, box.bottom - height / 2 - 1
    yield x, below
    yield x, above
    yield box.right + width / 2 + _GAP, y
    yield box.left - width / 2 - _GAP, y
    for across in (width / 3, -width / 3):
        yield x + across, below
        yield x + across, above


def draw_names(page: SvgWriter, names: list[PlacedName], ink: str) -> None:
    """Draw names with a light outline, so that they are also readable on walls."""
    for name in names:
        page.text(
            (name.box.left + name.box.right) / 2,
            name.box.bottom - 0.3 * name.size,
            name.text,
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
