"""Partitions: rooms, tiles, and cells that are given."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from safenav.world.map import RegionMap, rooms, tiles


def drawn(text: str) -> tuple[RegionMap, list[set[int]]]:
    """A map with the cell of each free region written into it."""
    lines = text.split()
    world = RegionMap.from_grid(["".join("#" if c == "#" else "." for c in row) for row in lines])
    cells: dict[str, set[int]] = {}
    for region, letter in enumerate("".join(lines)):
        if letter != "#":
            cells.setdefault(letter, set()).add(region)
    return world, [cells[letter] for letter in sorted(cells)]


@pytest.mark.parametrize(
    "text",
    [
        """
        #############
        #aaaaaaa#bbb#
        #aaaaaaa#bbb#
        #aaa#aaaabbb#
        #aaaaaaa#bbb#
        #aaaaaaa#bbb#
        #############
        """,
        """
        #############
        #aaaaaaa#bbb#
        #aaaaaaaabbb#
        #aaa#aaa#bbb#
        #aaaaaaaabbb#
        #aaaaaaa#bbb#
        #############
        """,
        """
        #############
        #aaa#bbb#ccc#
        #aaa#bbb#ccc#
        #aaaabbbbccc#
        #aaa#bbb#ccc#
        #aaa#bbb#ccc#
        #############
        """,
        """
        aa###cc
        aabbbcc
        aa###cc
        """,
        """
        aa##bb
        aaaabb
        aa##bb
        """,
        """
        aa#a
        aaaa
        aaa#
        """,
    ],
    ids=[
        "case study 1",
        "case study 2",
        "case study 3",
        "a corridor is a cell",
        "a deep doorway belongs to the first room",
        "a nook belongs to its room",
    ],
)
def test_rooms_are_divided_by_doorways(text: str) -> None:
    world, cells = drawn(text)
    assert [set(cell) for cell in rooms(world).cells] == sorted(cells, key=min)


def test_tiles_are_divided_by_walls() -> None:
    world, cells = drawn("""
        a#bcc
        a#bcc
        dddee
        """)
    assert [set(cell) for cell in tiles(world, 2, 3).cells] == sorted(cells, key=min)


@settings(max_examples=150)
@given(st.data())
def test_every_free_region_is_in_one_cell(data: st.DataObject) -> None:
    rows, cols = data.draw(st.integers(1, 7)), data.draw(st.integers(1, 8))
    line = st.lists(st.sampled_from("..#"), min_size=cols, max_size=cols).map("".join)
    world = RegionMap.from_grid(data.draw(st.lists(line, min_size=rows, max_size=rows)))
    most = data.draw(st.integers(1, 6))
    tiled = tiles(world, data.draw(st.integers(1, 4)), data.draw(st.integers(1, 4)))
    found = rooms(world)
    coarse = found.coarsened(most, world)
    for partition in (found, tiled, coarse):
        assert sorted(r for cell in partition.cells for r in cell) == list(world.free)
    assert len(coarse.cells) == min(most, len(found.cells))
    assert all(any(fine <= cell for cell in coarse.cells) for fine in found.cells)
