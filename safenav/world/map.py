"""The region map: positions of regions, walls, numbers and names.

Regions of an R x C map are numbered 0 .. R*C-1 in English reading order from the north-west (paper,
Section VI): ``id = row * cols + col``. Specifications and masks of poses rely on it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from enum import IntEnum
from functools import cached_property, lru_cache
from math import cos, sin
from typing import Annotated, Any

from msgspec import Meta, Struct, field

from safenav.data import cached_method
from safenav.strict_json import MOST_REGIONS


class Frame(Struct, frozen=True):
    """A map's frame. ``resolution``: side of a square region in metres; ``origin``: x and y of the
    map's south-western corner in metres; ``yaw``: counterclockwise rotation of the map about that
    corner in radians."""

    resolution: Annotated[float, Meta(gt=0)]
    origin: tuple[float, float] = (0.0, 0.0)
    yaw: float = 0.0

    def centre(self, row: float, col: float, rows: int) -> tuple[float, float]:
        """Return x and y, in metres, of a region's centre on a map with ``rows`` rows. A fractional
        ``row`` or ``col`` gives a point between regions."""
        return self.in_world((col + 0.5) * self.resolution, (rows - row - 0.5) * self.resolution)

    def in_world(self, east: float, north: float) -> tuple[float, float]:
        """Return x and y of a point that is ``east`` and ``north`` metres from the map's
        south-western corner, along the sides of the map."""
        x = self.origin[0] + east * cos(self.yaw) - north * sin(self.yaw)
        y = self.origin[1] + east * sin(self.yaw) + north * cos(self.yaw)
        return x, y

    def on_map(self, x: float, y: float) -> tuple[float, float]:
        """Return the metres of a point east and north of the map's corner, along its sides."""
        dx, dy = x - self.origin[0], y - self.origin[1]
        east = dx * cos(self.yaw) + dy * sin(self.yaw)
        return east, dy * cos(self.yaw) - dx * sin(self.yaw)


Region = Annotated[int, Meta(ge=0, lt=MOST_REGIONS)]
"""A region's number."""


class Heading(IntEnum):
    """A compass direction. The numbers go clockwise, as in specifications."""

    NORTH = 0
    EAST = 1
    SOUTH = 2
    WEST = 3

    @property
    def label(self) -> str:
        """The word in scenarios and traces: ``north``, ``east``, ``south`` or ``west``."""
        return self.name.lower()

    @property
    def opposite(self) -> Heading:
        return Heading((self + 2) % 4)

    @property
    def step(self) -> tuple[int, int]:
        """The change of (row, col) by one step in this direction."""
        return ((-1, 0), (0, 1), (1, 0), (0, -1))[self]


HEADINGS = {heading.label: heading for heading in Heading}

WALL = "#"
FREE = "."


class RegionMap(Struct, frozen=True, dict=True):
    """An R x C grid of regions, some of which are walls (the paper's known obstacles O).

    ``names``: regions by names that scenarios may use instead of numbers; ``areas``: sets of free
    regions by name; ``frame``: the map's position in metres, if known; ``notes``: sentences on
    losses, guesses and keys without effect from reading its scenario.
    """

    rows: int
    cols: int
    walls: frozenset[Region]
    names: Mapping[str, Region] = field(default_factory=dict)
    frame: Frame | None = None
    areas: Mapping[str, frozenset[Region]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __hash__(self) -> int:
        return hash((self.rows, self.cols, self.walls))

    @classmethod
    def from_grid(cls, lines: Iterable[str], **fields: Any) -> RegionMap:
        """Return the map of rows of ``#`` (wall) and ``.`` (free), all of equal length. ``fields``:
        other fields of the map."""
        rows = list(lines)
        cols = len(rows[0])
        walls = (region for region, sign in enumerate("".join(rows)) if sign == WALL)
        return cls(len(rows), cols, frozenset(walls), **fields)

    @property
    def placement(self) -> tuple[float, float, float]:
        """x and y in metres of the map's south-western corner, and its rotation in radians."""
        return (0.0, 0.0, 0.0) if self.frame is None else (*self.frame.origin, self.frame.yaw)

    @property
    def size(self) -> int:
        """Number of regions, walls included."""
        return self.rows * self.cols

    @cached_property
    def free(self) -> tuple[Region, ...]:
        """All regions that are not walls, ascending."""
        return tuple(r for r in range(self.size) if r not in self.walls)

    def region(self, row: int, col: int) -> Region:
        return row * self.cols + col

    def position(self, region: Region) -> tuple[int, int]:
        """Return (row, col) of a region."""
        return divmod(region, self.cols)

    def is_free(self, region: Region) -> bool:
        return 0 <= region < self.size and region not in self.walls

    def step(self, region: Region, heading: Heading) -> Region | None:
        """Return the next region in a direction, wall or not; None beyond the map's edge."""
        row, col = self.position(region)
        d_row, d_col = heading.step
        if 0 <= row + d_row < self.rows and 0 <= col + d_col < self.cols:
            return self.region(row + d_row, col + d_col)
        return None

    @cached_method
    def neighbours(self, region: Region) -> tuple[Region, ...]:
        """Return the free 4-neighbours, in the order north, east, south, west."""
        steps = (self.step(region, heading) for heading in Heading)
        return tuple(r for r in steps if r is not None and r not in self.walls)

    def distances(
        self, targets: Iterable[Region], inside: Collection[Region] | None = None
    ) -> dict[Region, int]:
        """Return the number of steps to the nearest of ``targets`` from each free region with a
        path there (only ``inside``, if given). The robot can turn on the spot."""
        depth = dict.fromkeys(targets, 0)
        queue = list(depth)
        for region in queue:
            for beside in self.neighbours(region):
                if beside not in depth and (inside is None or beside in inside):
                    depth[beside] = depth[region] + 1
                    queue.append(beside)
        return depth

    def grid_rows(self) -> list[str]:
        """Return the map as rows of ``#`` and ``.``, as in scenarios and trace headers."""
        return [
            "".join(WALL if self.region(r, c) in self.walls else FREE for c in range(self.cols))
            for r in range(self.rows)
        ]

    @cached_property
    def named(self) -> Mapping[Region, str]:
        """The first name of each named region."""
        return {region: name for name, region in reversed([*self.names.items()])}

    @cached_property
    def _in_area(self) -> Mapping[Region, str]:
        """The smallest area that contains a region, for each region in an area."""
        largest_first = sorted(self.areas.items(), key=lambda item: -len(item[1]))
        return {region: name for name, regions in largest_first for region in regions}

    def word(self, place: Region | frozenset[Region]) -> str:
        """Return a region as one word: its name or else its number. For a set of regions, return
        the areas in it and the other regions: ``ward_a|dock``."""
        if isinstance(place, int):
            return self.named.get(place, str(place))
        rest, words = place, []
        for name, regions in sorted(self.areas.items(), key=lambda item: -len(item[1])):
            if regions and regions <= rest and len(place) > 1:
                words.append(name)
                rest -= regions
        return "|".join([*words, *(self.word(region) for region in sorted(rest))])

    def place(self, region: Region) -> str:
        """Return words for a region: ``dock``, ``ward_a 40`` (in an area) or ``40``."""
        area = self._in_area.get(region) if region not in self.named else None
        return f"{area} {region}" if area else self.word(region)

    def label(self, region: Region) -> str:
        """Return the label of a region: ``47 [3, 8]``, or ``dock 47 [3, 8]`` with the name of the
        region or its area."""
        row, col = self.position(region)
        name = self.named.get(region) or self._in_area.get(region)
        return f"{name} {region} [{row}, {col}]" if name else f"{region} [{row}, {col}]"

    def stance(self, region: Region, heading: Heading | None) -> str:
        """Return the label of a pose: ``47 [3, 8] facing east``."""
        return self.label(region) + ("" if heading is None else f" facing {heading.label}")

    def labels(self, target: frozenset[Region]) -> str:
        """Return the label of a target: the name of an area, or the labels of all regions."""
        if target in self.areas.values():
            return self.word(target)
        return " or ".join(self.label(region) for region in sorted(target))


DOORWAY = 2
"""Maximum number of regions of a doorway; a longer narrow piece is a corridor."""

Cells = tuple[frozenset[Region], ...]
"""Parts of a map by which robots estimate the position of a robot out of sight, numbered from 0 in
the order of their lowest regions. Every free region belongs to exactly one cell.

Finer cells are more expensive: k cells make up to 2^k - 1 beliefs (``safenav.spec.belief``)."""


def in_order(cells: Iterable[Collection[Region]]) -> Cells:
    """Return cells sorted by their lowest regions."""
    return tuple(sorted(map(frozenset, cells), key=min))


def coarsened(cells: Cells, most: int, world: RegionMap) -> Cells:
    """Return at most ``most`` cells. While there are more, the smallest one joins its smallest
    neighbour or, if it has none, the smallest cell. Their beliefs contain those of ``cells``."""
    found = list(cells)
    while len(found) > max(1, most):
        least = min(found, key=lambda cell: (len(cell), min(cell)))
        found.remove(least)
        beside = _beside(least, found, world) or range(len(found))
        joined = min(beside, key=lambda index: (len(found[index]), min(found[index])))
        found[joined] |= least
    return in_order(found)


@lru_cache(maxsize=64)
def rooms(world: RegionMap) -> Cells:
    """Return the rooms and corridors of a map. A doorway belongs to one of the rooms that it joins.

    Open floor consists of the regions in fully free 2 x 2 squares; rooms are its connected pieces.
    The rest is narrow. A narrow piece of at most two regions is a doorway (or nook). It belongs to
    the room beside it whose open floor begins first in reading order. Any other piece is its own
    cell, such as a corridor. So an opening one region wide in a wall separates two rooms, but a
    pillar does not.
    """
    free, wide = {*world.free}, set[Region]()
    for region in world.free:
        square = {region, region + 1, region + world.cols, region + world.cols + 1}
        if (region + 1) % world.cols and square <= free:
            wide |= square
    floors = pieces(wide, world)
    cells = [set(floor) for floor in floors]
    for piece in pieces(free - wide, world):
        beside = _beside(piece, floors, world)
        if beside and len(piece) <= DOORWAY:
            cells[beside[0]] |= piece
        else:
            cells.append(set(piece))
    return in_order(cells)


@lru_cache(maxsize=64)
def tiles(world: RegionMap, height: int, width: int) -> Cells:
    """Return tiles of ``height`` rows and ``width`` columns from the north-west corner on. A tile
    divided by walls becomes a cell for each connected piece."""
    blocks: dict[tuple[int, int], set[Region]] = {}
    for region in world.free:
        row, col = world.position(region)
        blocks.setdefault((row // height, col // width), set()).add(region)
    return in_order(piece for block in blocks.values() for piece in pieces(block, world))


def pieces(regions: Collection[Region], world: RegionMap) -> list[frozenset[Region]]:
    """Return the connected pieces of a set of regions, in the order of their lowest regions."""
    left, found = set(regions), []
    for seed in sorted(regions):
        if seed in left:
            found.append(frozenset(world.distances([seed], left)))
            left -= found[-1]
    return found


def _beside(
    piece: frozenset[Region], floors: list[frozenset[Region]], world: RegionMap
) -> list[int]:
    """Return the indices of those ``floors`` that are adjacent to a piece."""
    around = {near for region in piece for near in world.neighbours(region)}
    return [index for index, floor in enumerate(floors) if floor & around]
