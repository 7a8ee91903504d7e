"""The cells into which a map is divided. What robots reach on it: ``team/test_batteries.py``; what
they see: ``judge/test_parts.py``."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from once import beside, from_yaml
from safenav import RegionMap
from safenav.world.map import coarsened, rooms, tiles


@st.composite
def maps(draw: st.DrawFn) -> RegionMap:
    rows, cols = draw(st.integers(1, 7)), draw(st.integers(1, 8))
    line = st.lists(st.sampled_from("...#"), min_size=cols, max_size=cols).map("".join)
    return RegionMap.from_grid(draw(st.lists(line, min_size=rows, max_size=rows)))


DIVIDED = from_yaml(beside(__file__, "divided.yaml"))


@pytest.mark.parametrize("claim", DIVIDED)
def test_rooms_and_corridors_are_divided_as_drawn(claim: str) -> None:
    drawn = DIVIDED[claim].split()
    grid = ["".join("#" if sign == "#" else "." for sign in row) for row in drawn]
    cells: dict[str, set[int]] = {}
    for region, sign in enumerate("".join(drawn)):
        cells.setdefault(sign, set()).add(region)
    cells.pop("#", None)
    world = RegionMap.from_grid(grid)
    found = tiles(world, 2, 3) if claim.startswith("tiles") else rooms(world)
    assert [set(cell) for cell in found] == sorted(cells.values(), key=min)


@settings(max_examples=150)
@given(maps(), st.integers(1, 6), st.integers(1, 4), st.integers(1, 4))
def test_every_free_region_is_in_one_cell(
    world: RegionMap, most: int, height: int, width: int
) -> None:
    found = rooms(world)
    coarse = coarsened(found, most, world)
    for partition in (found, tiles(world, height, width), coarse):
        assert sorted(r for cell in partition for r in cell) == list(world.free)
    assert len(coarse) == min(most, len(found))
    assert all(any(fine <= cell for cell in coarse) for fine in found)
