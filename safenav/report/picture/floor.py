"""The ground of all pictures: free regions, walls, and region numbers."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from safenav.report.picture.names import PlacedName, TextBox, outline
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
    """Return the side of one region: 48 for the maps of a paper, less for large ones."""
    return max(14.0, min(48.0, 1150.0 / max(world.cols, world.rows * 1.4)))


def window(world: RegionMap) -> tuple[float, float, float, float]:
    """Return the part of a map that pictures show, in regions: its left and upper border, width and
    height. It ends half a region beyond the free regions."""
    free = [world.position(region) for region in world.free] or [(0, 0)]
    rows, cols = [row for row, _ in free], [col for _, col in free]
    left, upper = max(0.0, min(cols) - 0.5), max(0.0, min(rows) - 0.5)
    right, lower = min(world.cols, max(cols) + 1.5), min(world.rows, max(rows) + 1.5)
    return left, upper, right - left, lower - upper


def draw_floor(page: SvgWriter, world: RegionMap, cell: float) -> None:
    """Draw regions and walls, the map's north-western corner at the origin."""
    width, height = world.cols * cell, world.rows * cell
    page.rect(0, 0, width, height, fill="#FFFFFF", stroke=WALL_LINE, stroke_width=1)
    lines = [f"M0,{number(r * cell)}H{number(width)}" for r in range(1, world.rows)]
    lines += [f"M{number(c * cell)},0V{number(height)}" for c in range(1, world.cols)]
    page.path("".join(lines), stroke=LINES, stroke_width=0.75, fill="none")
    page.path(filled(world, world.walls, cell), fill=WALL)
    page.path(outline(world, world.walls, cell), fill="none", stroke=WALL_LINE, stroke_width=0.75)


def filled(world: RegionMap, regions: Collection[Region], cell: float) -> str:
    """Return a path of one rectangle for each run of regions in a row, which avoids seams."""
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
    """Draw the number of each free region without one of the ``names`` in its corner; none where
    the numbers of neighbours would overlap."""
    size = max(_LEGIBLE, cell * 0.17)
    if cell < max(LEAST_NUMBERED, text_width(f"{world.size - 1} ", size)):
        return
    named = {world.names[name.text] for name in names if not name.area}
    page.open("g", font_size=number(size), fill="#7A818C")
    for region in world.free:
        if region in named:
            continue
        row, col = world.position(region)
        x, y = (col + 0.07) * cell, row * cell + 0.03 * cell + size
        box = TextBox(x, y - size, x + text_width(str(region), size), y)
        if not any(box.overlaps(name.box) for name in names):
            page.element("text", str(region), x=x, y=y)
    page.close("g")


def draw_axes(page: SvgWriter, world: RegionMap, cell: float) -> None:
    """Draw the number of each row at the left of the window and of each column below it; if regions
    are small, of every fifth."""
    every = 1 if cell >= text_width(f"{world.cols - 1} ", _LEGIBLE) else 5
    left, upper, width, height = window(world)
    page.open("g", font_size=number(_LEGIBLE), fill=MUTED)
    for row in range(0, world.rows, every):
        if upper <= row <= upper + height - 1:
            y = (row + 0.5) * cell + 0.35 * _LEGIBLE
            page.element("text", str(row), x=left * cell - 2, y=y, text_anchor="end")
    for col in range(0, world.cols, every):
        if left <= col <= left + width - 1:
            x, y = (col + 0.5) * cell, (upper + height) * cell + 1.2 * _LEGIBLE
            page.element("text", str(col), x=x, y=y, text_anchor="middle")
    page.close("g")
