"""Maps: numbering in reading order, walls, neighbours."""

import pytest

from safenav.world.map import Heading, RegionMap

CORNER = RegionMap.from_grid(["..#", "...", "#.."])


def test_regions_are_numbered_in_reading_order() -> None:
    assert [CORNER.region(row, col) for row in range(3) for col in range(3)] == list(range(9))
    assert CORNER.position(5) == (1, 2)
    assert CORNER.label(5) == "5 [1, 2]"


def test_walls_and_free_regions_share_the_map() -> None:
    assert CORNER.walls == {2, 6}
    assert CORNER.free == (0, 1, 3, 4, 5, 7, 8)
    assert not CORNER.is_free(-1)
    assert not CORNER.is_free(9)


def test_neighbours_come_north_east_south_west_without_walls() -> None:
    assert CORNER.neighbours(4) == (1, 5, 7, 3)
    assert CORNER.neighbours(1) == (4, 0)
    assert CORNER.neighbours(8) == (5, 7)


def test_a_step_over_the_edge_leads_nowhere() -> None:
    assert CORNER.step(5, Heading.EAST) is None
    assert CORNER.step(0, Heading.NORTH) is None
    assert CORNER.step(3, Heading.WEST) is None
    assert CORNER.step(8, Heading.SOUTH) is None
    assert CORNER.step(5, Heading.NORTH) == 2  # a wall is a region, too


def test_a_grid_reads_back() -> None:
    assert RegionMap.from_grid(CORNER.grid_rows()) == CORNER


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([], "empty"),
        ([""], "empty"),
        (["..", "."], "row 1 has 1 characters, row 0 has 2"),
        (["..", ".x"], "row 1, column 1: 'x'"),
    ],
)
def test_bad_grids_are_refused(rows: list[str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        RegionMap.from_grid(rows)


@pytest.mark.parametrize("heading", list(Heading))
def test_going_there_and_back(heading: Heading) -> None:
    there = CORNER.step(4, heading)
    assert there is not None
    assert CORNER.step(there, heading.opposite) == 4
    assert Heading[heading.label.upper()] is heading
