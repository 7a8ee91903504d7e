"""Regions in metres: the floor of a map, boxes, headings and margins.

The frame of a motion: x east, y north, origin at the south-western corner of the map, metres,
radians counter-clockwise from east.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

Array = NDArray[np.float64]

HEADINGS = ("east", "north", "west", "south")
"""In the order of quarter turns counter-clockwise."""

_UNIT_VECTORS = {"east": (1, 0), "north": (0, 1), "west": (-1, 0), "south": (0, -1)}


class Box(Struct, frozen=True):
    """A rectangle along the axes, in metres."""

    west: float
    south: float
    east: float
    north: float


class MetricFloor(Struct, frozen=True):
    """A map of square regions: ``side`` metres each, numbered in reading order."""

    rows: int
    cols: int
    side: float

    def centre(self, region: int) -> tuple[float, float]:
        row, col = divmod(region, self.cols)
        return (col + 0.5) * self.side, (self.rows - row - 0.5) * self.side

    def box(self, region: int) -> Box:
        x, y = self.centre(region)
        half = self.side / 2
        return Box(x - half, y - half, x + half, y + half)

    def corridor(self, one: int, other: int, inset: float = 0.0) -> Box:
        """The region of a rest, or the two regions of a step; less a rim, in metres."""
        a, b = self.box(one), self.box(other)
        west, south = min(a.west, b.west) + inset, min(a.south, b.south) + inset
        return Box(west, south, max(a.east, b.east) - inset, max(a.north, b.north) - inset)

    def heading(self, origin: int, to: int) -> str:
        """The heading of a step between two regions that lie side by side."""
        (row, col), (next_row, next_col) = divmod(origin, self.cols), divmod(to, self.cols)
        step = (next_col - col, row - next_row)
        return next(name for name, ahead in _UNIT_VECTORS.items() if ahead == step)


def turn(before: str, after: str) -> int:
    """Quarter turns counter-clockwise between two headings: -1, 0, 1 or 2."""
    quarters = (HEADINGS.index(after) - HEADINGS.index(before)) % 4
    return quarters - 4 if quarters == 3 else quarters


def unit_vector(heading: str) -> tuple[int, int]:
    """A heading as an integer unit vector, so that rotation by it is exact."""
    return _UNIT_VECTORS[heading]


def margin(points: Array, box: Box) -> Array:
    """Return the depth of each point (n, 2) inside a box, in metres; negative outside."""
    x, y = points[:, 0], points[:, 1]
    inside: Array = np.minimum.reduce([x - box.west, box.east - x, y - box.south, box.north - y])
    return inside
