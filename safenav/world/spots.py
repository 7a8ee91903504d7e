"""Connected spots of pixels: rooms, and the walls that a share removes.

Spots are found by the runs of their rows and a union-find over runs that touch (Rosenfeld and
Pfaltz, 1966), so that the work grows with the outline of a drawing and not with its pixels.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.world.images import Blocked, Layout, walls
from safenav.world.map import Region, RegionMap
from safenav.world.partition import pieces

MOST_RUNS = 300_000
"""Most runs of a floor plan; an image with more is not searched for spots."""

_SHOWN = 3
_ENOUGH = 0.6
"""Share of the free floor that a division has to keep connected to be suggested."""


class Spots(Struct, frozen=True):
    """The spots of a mask: their boxes (top, left, bottom, right; the last two not included),
    pixels, and the spot of each run."""

    boxes: NDArray[np.int64]
    pixels: NDArray[np.int64]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    owner: NDArray[np.int64]
    width: int

    def at(self, row: int, col: int) -> int | None:
        """The spot that holds a pixel."""
        where = row * self.width + col
        run = int(np.searchsorted(self.starts, where, "right")) - 1
        return int(self.owner[run]) if run >= 0 and where < self.ends[run] else None


def spots(mask: Blocked) -> Spots | None:
    """The connected spots of a mask; None for too many runs."""
    padded = np.zeros((mask.shape[0], mask.shape[1] + 2), dtype=np.int8)
    padded[:, 1:-1] = mask
    width = padded.shape[1]
    edges = np.diff(padded.ravel())
    starts, ends = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1
    if len(starts) > MOST_RUNS:
        return None
    parent = list(range(len(starts)))

    def root(run: int) -> int:
        while parent[run] != run:
            parent[run] = parent[parent[run]]
            run = parent[run]
        return run

    first, last = starts.tolist(), ends.tolist()
    above = 0
    for run, start in enumerate(first):
        begin, end = start - width, last[run] - width
        while last[above] <= begin:
            above += 1
        other = above
        while first[other] < end:
            parent[root(other)] = root(run)
            other += 1
    roots = np.array([root(run) for run in range(len(parent))], dtype=np.int64)
    _, owner = np.unique(roots, return_inverse=True)
    count = int(owner.max()) + 1 if len(owner) else 0
    boxes = np.zeros((count, 4), dtype=np.int64)
    boxes[:, :2] = mask.shape[0] + width
    rows, lefts = starts // width, starts % width - 1
    np.minimum.at(boxes[:, 0], owner, rows)
    np.minimum.at(boxes[:, 1], owner, lefts)
    np.maximum.at(boxes[:, 2], owner, rows + 1)
    np.maximum.at(boxes[:, 3], owner, lefts + ends - starts)
    pixels = np.bincount(owner, ends - starts, count).astype(np.int64)
    return Spots(boxes, pixels, starts - 1 - 2 * rows, ends - 1 - 2 * rows, owner, width - 2)


def losses(blocked: Blocked, layout: Layout, world: RegionMap, share: float) -> tuple[str, ...]:
    """Return sentences on the walls, rooms and passages that the division into regions removes."""
    if layout.height == layout.width == 1:
        return ()  # a region is a pixel
    sentences = []
    if share > 0:
        sentences += [
            f"a share of {share:g} removes a wall: {_stretch(group, world)} "
            f"{'is' if len(group) == 1 else 'are'} free although the image draws a wall across; "
            "use a smaller share or smaller regions"
            for group in _largest_first(_crossed(blocked, layout, world), world)
        ]
    rooms = spots(~blocked)
    if rooms is None:
        return _some(sentences)
    held: dict[int, set[int]] = {}
    connected = rooms_of(world)
    for number, piece in enumerate(connected):
        for region in piece:
            top, left, bottom, right = _pixels(region, layout, world, blocked.shape)
            spot = rooms.at((top + bottom) // 2, (left + right) // 2)
            if spot is not None:
                held.setdefault(spot, set()).add(number)
    area = float(layout.height * layout.width)
    for spot, pixels in enumerate(rooms.pixels.tolist()):
        top, left, bottom, right = rooms.boxes[spot].tolist()
        centre = (top + bottom) // 2, (left + right) // 2
        # Floor that reaches the edge of the image is its margin, not a room.
        inside = min(top, left) > 0 and bottom < blocked.shape[0] and right < blocked.shape[1]
        if spot not in held and inside and 2 * pixels >= area:
            cause = f"a share of {share:g} removes" if share > 0 else "the division removes"
            sentences.append(
                f"{cause} a room: {right - left} x {bottom - top} pixels around pixel "
                f"[{centre[0]}, {centre[1]}] hold no free region; use smaller regions"
                + ("" if share > 0 else " or a share")
            )
        whole = sorted(held.get(spot, ()), key=lambda number: len(connected[number]))
        sentences += [
            f"{_stretch(sorted(connected[number]), world)} "
            f"{'is' if len(connected[number]) == 1 else 'are'} cut off: the image has a passage "
            "that is narrower than a region; use smaller regions"
            + (" or a larger share" if share > 0 else " or a share")
            for number in whole[:-1]
        ]
    return _some(sentences)


def _some(sentences: Sequence[str]) -> tuple[str, ...]:
    more = len(sentences) - _SHOWN
    return (*sentences[:_SHOWN], *((f"and {more} more losses of this kind",) if more > 0 else ()))


def _stretch(group: Sequence[Region], world: RegionMap) -> str:
    """``3 regions from 40 [1, 2] to 42 [1, 4]``."""
    if len(group) == 1:
        return f"region {world.label(group[0])}"
    return f"{len(group)} regions from {world.label(group[0])} to {world.label(group[-1])}"


def _pixels(
    region: Region, layout: Layout, world: RegionMap, shape: tuple[int, ...]
) -> tuple[int, int, int, int]:
    """The pixels that lie in a region: top, left, bottom, right (the last two not included)."""
    row, col = world.position(region)
    south = world.rows - 1 - row
    bottom, top = shape[0] - south * layout.height, shape[0] - (south + 1) * layout.height
    left, right = col * layout.width, (col + 1) * layout.width
    sides = (max(0, int(top)), int(left), -(-bottom // 1), min(shape[1], -(-right // 1)))
    return sides[0], sides[1], int(sides[2]), int(sides[3])


def _crossed(blocked: Blocked, layout: Layout, world: RegionMap) -> list[Region]:
    """Free regions that blocked pixels cross from one side to the opposite one."""
    found = []
    for region in world.free:
        top, left, bottom, right = _pixels(region, layout, world, blocked.shape)
        part = blocked[top:bottom, left:right]
        if part.any() and (part.any(axis=0).all() or part.any(axis=1).all()):
            found.append(region)
    return found


def rooms_of(world: RegionMap) -> list[list[Region]]:
    """The connected groups of free regions, the largest first."""
    return _largest_first(world.free, world)


def _largest_first(regions: Collection[Region], world: RegionMap) -> list[list[Region]]:
    groups = [sorted(piece) for piece in pieces(regions, world)]
    return sorted(groups, key=lambda group: (-len(group), group))


def suggested(blocked: Blocked) -> tuple[int, int]:
    """Rows and columns of square regions: the fewest that keep most of the free floor connected."""
    height, width = blocked.shape
    best, left = (1, 1), -1.0
    for longer in (12, 16, 20, 25, 30, 40, 50, 64, 80, 100, 128):
        side = max(height, width) / min(longer, max(height, width))
        rows, cols = max(1, round(height / side)), max(1, round(width / side))
        layout = Layout.of_count(blocked, rows, cols)
        world = RegionMap(rows, cols, walls(blocked, layout))
        rooms = rooms_of(world)
        share = len(rooms[0]) / (rows * cols) if rooms else 0.0
        if share >= _ENOUGH * float((~blocked).mean()):
            return rows, cols
        if share > left:
            best, left = (rows, cols), share
    return best
