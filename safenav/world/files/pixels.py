"""Conversion of a map's pixels to regions: one rule for images of every kind.

A pixel is blocked or free (each format defines which). A region is the rectangle of pixels below
it. Where borders of regions and pixels differ, a pixel counts for each region by the area that they
share. The region is a wall if any of its area is blocked, so a free region is entirely free. With a
``share`` above 0 that much of its area must be blocked, so that specks and walls slightly off the
grid do not count.

Which pixels a region touches is computed in integers, so the rule is exact; only the comparison
with a share above 0 is done in floating point, with a tolerance of a billionth.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.world.map import Region

Blocked = NDArray[np.bool_]
"""Rows of pixels from the north, true where no robot can go."""

_TOLERANCE = 1e-9
_FINEST = 1000
"""Region borders lie on multiples of a thousandth of a pixel at most, so that the integers
below stay small."""


class Layout(Struct, frozen=True):
    """A map of ``rows`` x ``cols`` regions over pixels: each is ``height`` x ``width`` pixels.

    The south-western corners of both coincide; regions may extend beyond the pixels in the north
    and the east, where all is blocked.
    """

    rows: int
    cols: int
    height: Fraction
    width: Fraction

    @classmethod
    def of_count(cls, blocked: Blocked, rows: int, cols: int) -> Layout:
        """Divide all pixels into this many rows and columns."""
        return cls(rows, cols, Fraction(blocked.shape[0], rows), Fraction(blocked.shape[1], cols))

    @classmethod
    def of_size(cls, blocked: Blocked, side: Fraction) -> Layout:
        """Divide all pixels into squares of ``side`` pixels; the last may extend beyond them."""
        side = side.limit_denominator(_FINEST)
        rows, cols = (-(-pixels // side) for pixels in blocked.shape)
        return cls(int(rows), int(cols), side, side)


def walls(blocked: Blocked, layout: Layout, share: float = 0.0) -> frozenset[Region]:
    """The regions that are walls. ``share`` of a region blocked, 0 to 1; 0: any of it."""
    area = shares(blocked, layout)
    found = area > 0 if share == 0 else area >= share - _TOLERANCE
    return frozenset(int(region) for region in np.flatnonzero(found))


def shares(blocked: Blocked, layout: Layout) -> NDArray[np.float64]:
    """Return the share of each region that the true pixels cover, in rows from the north; pixels
    beyond the image count as true."""
    turned = blocked[::-1]  # from the south, where both start
    down = _overlaps(turned.shape[0], layout.height, layout.rows)
    aside = _overlaps(turned.shape[1], layout.width, layout.cols)
    bands = np.stack([weights @ turned[first:last] for first, last, weights in down])
    columns = np.zeros((turned.shape[1], layout.cols))
    for col, (first, last, weights) in enumerate(aside):
        columns[first:last, col] = weights
    covered: NDArray[np.float64] = (bands @ columns + _beyond(down, aside))[::-1]
    return covered


Overlap = tuple[int, int, NDArray[np.float64]]
"""First pixel, last (exclusive), and the share of the region's side that each pixel covers."""


def _overlaps(pixels: int, side: Fraction, count: int) -> list[Overlap]:
    """Return the pixels below each region along one axis. In integer units a pixel is ``unit`` long
    and a region ``long``."""
    long, unit = side.numerator, side.denominator
    found = []
    for index in range(count):
        begin, end = index * long, (index + 1) * long
        first, last = min(pixels, begin // unit), min(pixels, -(-end // unit))
        starts = np.arange(first, last, dtype=np.int64) * unit
        covered = np.minimum(starts + unit, end) - np.maximum(starts, begin)
        found.append((first, last, covered / long))
    return found


def _beyond(down: list[Overlap], aside: list[Overlap]) -> NDArray[np.float64]:
    """Return the share of each region beyond the pixels: exactly 0 for a region within them."""
    inside_down, inside_aside = (
        np.array([min(1.0, float(weights.sum())) for _, _, weights in axis])
        for axis in (down, aside)
    )
    outside = 1.0 - np.outer(inside_down, inside_aside)
    return np.where(outside > _TOLERANCE, outside, 0.0)
