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
"""Heights of letters; large ones are better, and a name in its own region is best."""
_LINE = 1.2
_GAP = 2.0
_BODY = 0.3
"""Half the side, in cells, of the central part of a named region, where robots are drawn."""
_MOST_BOXES = 24
_NUMBER = (0.45, 0.3)
"""Width and height of the corner of a region that has its number, in cells."""
_ON_WALL = 0.6
_BESIDE = 0.1
"""Costs of a name on a wall, and for each other region that it reaches into."""


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
    width, height = world.cols * cell, world.rows * cell
    subjects = [(name, frozenset({region}), False) for name, region in world.names.items()]
    subjects += [(name, area, True) for name, area in world.areas.items()]
    bodies = [_within(_cell(world, region, cell), _BODY) for region in world.names.values()]
    names: list[PlacedName] = []
    for text, own, area in subjects:
        options: list[tuple[float, PlacedName]] = []
        for size in _SIZES:
            wide, high = text_width(text, size, bold=True) + _GAP, _LINE * size
            if wide > width or high > height:
                continue
            for box in _middle_first(world, own, cell):
                for x, y in _places(box, wide, high, area):
                    left = min(max(x - wide / 2, 0.0), width - wide)
                    top = min(max(y - high / 2, 0.0), height - high)
                    found = TextBox(left, top, left + wide, top + high)
                    if not any(found.overlaps(name.box) for name in names):
                        cost = _cost(world, own, cell, found)
                        cost += sum(_shared(found, body) for body in bodies)
                        cost += 0.03 * (_SIZES[0] - size) + 1e-4 * len(options)
                        options.append((cost, PlacedName(text, size, found, area)))
        if options:
            names.append(min(options, key=lambda option: option[0])[1])
    return names


def _cost(world: RegionMap, own: frozenset[Region], cell: float, box: TextBox) -> float:
    """Return how much a name covers that is not its own: numbers, other regions, walls."""
    cost = 0.0
    for row in range(int(box.top // cell), min(world.rows, int(box.bottom // cell) + 1)):
        for col in range(int(box.left // cell), min(world.cols, int(box.right // cell) + 1)):
            region = world.region(row, col)
            place = _cell(world, region, cell)
            share = _shared(box, place)
            cost += 0.0 if region in own or share == 0.0 else _BESIDE
            if not world.is_free(region):
                cost += _ON_WALL * share
                continue
            corner = (place.left + _NUMBER[0] * cell, place.top + _NUMBER[1] * cell)
            cost += 2.0 * box.overlaps(TextBox(place.left, place.top, *corner))
            cost += share * (region not in own)
    return cost


def _shared(box: TextBox, other: TextBox) -> float:
    """Return the part of a box that another one covers."""
    wide = min(box.right, other.right) - max(box.left, other.left)
    high = min(box.bottom, other.bottom) - max(box.top, other.top)
    return max(0.0, wide) * max(0.0, high) / ((box.right - box.left) * (box.bottom - box.top))


def _within(box: TextBox, half: float) -> TextBox:
    """Return the central part of a square, with this half of a side in squares."""
    inset = (0.5 - half) * (box.right - box.left)
    return TextBox(box.left + inset, box.top + inset, box.right - inset, box.bottom - inset)


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
