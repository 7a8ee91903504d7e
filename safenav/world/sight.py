"""Visibility: a radius and a line of sight that walls and closed obstacles block.

Regions are unit squares, and a robot looks from the centre of its own. Region ``t`` is visible from
``s`` if

1. their centres are at most ``radius`` apart (Euclidean, in regions; None for unlimited),
2. no wall and no closed obstacle lies on the segment between the centres, where a region lies
   on it if the segment passes through the region's interior (``s`` and ``t`` themselves do not
   count: a robot sees out of, and into, a doorway whose obstacle is closed), and
3. the segment does not slip between two such regions that touch at a corner only: a line
   exactly through a corner is blocked if both regions beside it are, but not by one alone.

Walls have no view and are never visible. The definition treats both ends of the segment alike, so
visibility is symmetric. A region and its four neighbours are always visible, so a robot out of
sight is at least two steps away.

All lines with the same offset cross the same squares, shifted. So the whole map is one integer with
a bit for each region, and shifts and masks test a line of sight for all regions in parallel. Rows
are padded to twice their width, so a shift never carries a bit into another row. 5,000 lines of a
50 x 50 map take a fraction of a second.
"""

from collections.abc import Iterable
from functools import cache, cached_property, lru_cache
from math import isqrt

from safenav.data import cached_method
from safenav.world.map import Region, RegionMap
from safenav.world.poses import Mask, region_mask

Offset = tuple[int, int]


class Visibility:
    """The regions visible from each region. ``radius``: a number of regions, at least 1; None:
    unlimited. ``closed``: regions whose obstacle blocks the view."""

    def __init__(
        self, world: RegionMap, radius: float | None, closed: frozenset[Region] = frozenset()
    ) -> None:
        self.world = world
        farthest = world.rows + world.cols
        self._radius = farthest if radius is None else min(radius, farthest)
        self.closed = closed
        self._width = 2 * world.cols

    @cached_method
    def mask(self, source: Region) -> Mask:
        """Return all regions visible from ``source``, including itself; none from a wall."""
        world, width = self.world, self._width
        row, col = world.position(source)
        here = row * width + col
        seen = 0
        for there in range(world.rows):
            if (lines := self._lines.get(abs(there - row))) is None:
                continue
            reach = len(lines) // 2
            first, last = max(0, col - reach), min(world.cols - 1, col + reach)
            window = range(first - col + reach, last - col + reach + 1)
            if there >= row:
                bits = [lines[i][here] for i in window]
            else:  # lines are stored at their northern end
                start = there * width + first
                bits = [lines[-1 - i][start + n] for n, i in enumerate(window)]
            seen |= int("".join(reversed(bits)), 2) << world.region(there, first)
        return seen

    @cached_property
    def _lines(self) -> dict[int, list[str]]:
        """For each number of rows to the south and each sideways offset from west to east, the
        regions of the padded map with a free line of sight over this offset. They are a text whose
        character ``i`` is 1 if bit ``i`` is set."""
        world = self.world
        free = self._padded(world.free)
        opaque = self._padded(world.walls | self.closed)
        digits = world.rows * self._width
        lines: dict[int, list[str]] = {}
        for rows in range(min(world.rows, int(self._radius) + 1)):
            reach = min(world.cols - 1, isqrt(int(self._radius**2 - rows**2)))
            lines[rows] = []
            for cols in range(-reach, reach + 1):
                clear = free & self._moved(free, (rows, cols))
                clear &= ~self._obstructed(opaque, rows, cols)
                lines[rows].append(f"{clear:0{digits}b}"[::-1])
        return lines

    def _obstructed(self, opaque: int, rows: int, cols: int) -> int:
        """Return the regions whose line of sight over this offset is obstructed."""
        through, corners = crossed(rows, cols)
        found = 0
        for square in through:
            found |= self._moved(opaque, square)
        for one, other in corners:
            found |= self._moved(opaque, one) & self._moved(opaque, other)
        return found

    def _moved(self, regions: int, offset: Offset) -> int:
        """Return the regions that this offset moves into ``regions``."""
        shift = offset[0] * self._width + offset[1]
        return regions >> shift if shift >= 0 else regions << -shift

    def _padded(self, regions: Iterable[Region]) -> int:
        positions = map(self.world.position, regions)
        return region_mask(row * self._width + col for row, col in positions)


visible_from = lru_cache(maxsize=64)(Visibility)
"""Visibility on a map, computed once for each map, radius and set of closed obstacles."""


@cache
def crossed(rows: int, cols: int) -> tuple[tuple[Offset, ...], tuple[tuple[Offset, Offset], ...]]:
    """Return two tuples for the segment from the centre of (0, 0) to that of (rows, cols), rows not
    negative: the squares whose interiors it crosses, without the ends; and the two squares beside
    each corner that it hits exactly.

    The segment leaves the j-th column at the fraction (2j + 1) / (2 |cols|) of its length, and row
    i at (2i + 1) / (2 rows). The comparison needs no division.
    """
    aside, cols = -1 if cols < 0 else 1, abs(cols)
    row = col = 0
    through: list[Offset] = []
    corners: list[tuple[Offset, Offset]] = []
    while (row, col) != (rows, cols):
        sideways, down = (2 * col + 1) * rows, (2 * row + 1) * cols
        if sideways == down:
            corners.append(((row, aside * (col + 1)), (row + 1, aside * col)))
            row, col = row + 1, col + 1
        elif col < cols and (row == rows or sideways < down):
            col += 1
        else:
            row += 1
        through.append((row, aside * col))
    return tuple(through[:-1]), tuple(corners)
