"""Cells of a map, by which robots estimate the position of one that is out of sight.

A partition divides all free regions among cells, which are derived from the map:

``rooms``   Open floor: regions in a fully free 2 x 2 square. Rooms are its connected pieces. The
            rest is narrow. A narrow piece of at most two regions is a doorway (or a nook) and
            belongs to a room that it touches, the one whose open floor begins first in reading
            order; a longer one is a corridor, a cell of its own. So an opening one region wide in a
            wall separates two rooms, and a pillar does not.
``tiles``   Squares of the given height and width, laid from the north-west corner; a tile that
            walls divide gives a cell for each connected piece.

Finer cells are more expensive: k cells make up to 2^k - 1 beliefs
(``safenav.spec.belief``).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import lru_cache

from msgspec import Struct

from safenav.components import explored
from safenav.world.map import Region, RegionMap

DOORWAY = 2
"""Maximum number of regions of a doorway; a longer narrow piece is a corridor."""


class Partition(Struct, frozen=True):
    """The cells of a map, numbered from 0 in the order of their lowest regions.

    Every free region belongs to exactly one cell.
    """

    cells: tuple[frozenset[Region], ...]

    @classmethod
    def of(cls, cells: Iterable[Collection[Region]]) -> Partition:
        """Return the partition with these cells."""
        return cls(tuple(sorted(map(frozenset, cells), key=min)))

    def coarsened(self, most: int, world: RegionMap) -> Partition:
        """The partition with the smallest cell joined to its smallest neighbour (to any cell if
        it has none) until there are at most ``most``.

        Its beliefs contain those of this partition.
        """
        cells = list(self.cells)
        while len(cells) > max(1, most):
            least = min(cells, key=lambda cell: (len(cell), min(cell)))
            cells.remove(least)
            beside = _beside(least, cells, world) or range(len(cells))
            joined = min(beside, key=lambda index: (len(cells[index]), min(cells[index])))
            cells[joined] |= least
        return Partition.of(cells)

    def regions(self, cells: Iterable[int]) -> frozenset[Region]:
        """Return all regions of some cells."""
        return frozenset().union(*(self.cells[cell] for cell in cells))


@lru_cache(maxsize=64)
def rooms(world: RegionMap) -> Partition:
    """The rooms and corridors of a map, doorways with one of the rooms that they join."""
    wide = {r for r in world.free if _has_space(r, world)}
    floors = pieces(wide, world)
    cells = [set(floor) for floor in floors]
    for piece in pieces(set(world.free) - wide, world):
        beside = _beside(piece, floors, world)
        if beside and len(piece) <= DOORWAY:
            cells[beside[0]] |= piece
        else:
            cells.append(set(piece))
    return Partition.of(cells)


@lru_cache(maxsize=64)
def tiles(world: RegionMap, height: int, width: int) -> Partition:
    """Tiles of ``height`` rows and ``width`` columns. Raises ValueError if one is below 1."""
    if height < 1 or width < 1:
        raise ValueError(f"tiles of {height} x {width} regions")
    blocks: dict[tuple[int, int], set[Region]] = {}
    for region in world.free:
        row, col = world.position(region)
        blocks.setdefault((row // height, col // width), set()).add(region)
    cells = [piece for block in blocks.values() for piece in pieces(block, world)]
    return Partition.of(cells)


def _has_space(region: Region, world: RegionMap) -> bool:
    """Whether the region lies in a fully free 2 x 2 square."""
    row, col = world.position(region)

    def free(r: int, c: int) -> bool:
        return 0 <= r < world.rows and 0 <= c < world.cols and world.is_free(world.region(r, c))

    return any(
        free(row + down, col) and free(row, col + aside) and free(row + down, col + aside)
        for down in (-1, 1)
        for aside in (-1, 1)
    )


def pieces(regions: Collection[Region], world: RegionMap) -> list[frozenset[Region]]:
    """The connected pieces of a set of regions, in the order of their lowest regions."""
    inside, left, found = set(regions), set(regions), []
    for seed in sorted(regions):
        if seed in left:
            near = explored([seed], lambda region: [*inside.intersection(world.neighbours(region))])
            found.append(frozenset(near))
            left -= near.keys()
    return found


def _beside(
    piece: frozenset[Region], floors: list[frozenset[Region]], world: RegionMap
) -> list[int]:
    """Return the indices of the floors that a piece touches."""
    around = {near for region in piece for near in world.neighbours(region)}
    return [index for index, floor in enumerate(floors) if floor & around]
