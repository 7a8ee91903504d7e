"""The ``partition:`` of a scenario: the cells of beliefs about robots out of sight."""

from __future__ import annotations

from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence
from safenav.scenario.yaml.shapes import Key, Shape, Table, either, form, many, several, whole
from safenav.world.map import Region
from safenav.world.partition import Partition, tiles

ROOMS = "rooms"

_EXPECTED = "'rooms', {tiles: [rows, columns]}, or a list of cells [[8, 9], [12, [1, 6]]]"
_SHOWN = 5


class TileKeys(Table):
    tiles = Key(
        form(several(whole(1), whole(1))),
        "Rows and columns of a tile.",
        required="for example {tiles: [4, 4]}",
    )


def _partition(
    node: Node | None, what: str, reading: Reading
) -> tuple[frozenset[Region], ...] | None:
    """Return the cells; None for the rooms of the map, or if something was reported."""
    match node:
        case None:
            return None
        case Scalar(value=word) if word == ROOMS:
            return None
        case Mapping():
            return _tiles(node, reading)
        case Sequence():
            return _cells(node, reading)
    read.wrong_type(node, what, _EXPECTED, reading)
    return None


def _tiles(node: Mapping, reading: Reading) -> tuple[frozenset[Region], ...] | None:
    what = "'tiles' of partition"
    item = TileKeys.read(node, "'partition'", reading)
    sides = item.tiles if item else None
    if not isinstance(sides, Sequence) or len(sides.items) != 2:
        read.wrong_type(sides, what, "[rows, columns]", reading)
        return None
    height, width = (
        read.integer(side, f"{word} in {what}", reading, least=1)
        for side, word in zip(sides.items, ("rows", "columns"), strict=True)
    )
    if height is None or width is None or reading.world is None:
        return None
    return tiles(reading.world, height, width).cells


def _cells(node: Sequence, reading: Reading) -> tuple[frozenset[Region], ...] | None:
    """Return cells given as lists of regions, in which each free region occurs once."""
    before = len(reading)
    owner: dict[Region, int] = {}
    cells = []
    for number, item in enumerate(node.items):
        what = f"cell {number} of partition"
        listed = read.sequence(item, what, reading) or ()
        if isinstance(item, Sequence) and not listed:
            reading.add(item, f"{what} is empty", "a cell has at least one region")
        found = []
        for place in listed:
            for region in sorted(reading.regions(place, what) or ()):
                if owner.setdefault(region, number) != number:
                    twice = f"{what}: region {region} is already in cell {owner[region]}"
                    reading.add(place, twice, "a region belongs to one cell")
                found.append(region)
        cells.append(frozenset(found))
    world = reading.world
    if world is None or len(reading) > before:
        return None
    missing = [world.label(region) for region in world.free if region not in owner]
    if missing:
        more = f" and {len(missing) - _SHOWN} more" if len(missing) > _SHOWN else ""
        told = f"'partition': free regions in no cell: {', '.join(missing[:_SHOWN])}{more}"
        reading.add(node, told, "a robot may be anywhere: every free region needs a cell")
        return None
    return Partition.given(cells, world).cells


PARTITION = Shape(
    either({"const": ROOMS}, TileKeys, many(many(REGION, 1), 1)),
    _partition,
    "partition",
    "The cells in which a robot out of sight may be. Default: rooms.",
)
