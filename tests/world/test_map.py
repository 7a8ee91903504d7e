"""What a map means: its cells, what robots reach on it and see there."""

from itertools import product
from random import Random

import networkx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from safenav import RegionMap
from safenav.world.map import rooms, tiles
from safenav.world.poses import Mobility, PoseGraph, bits
from safenav.world.sight import visible_from


@st.composite
def maps(draw: st.DrawFn) -> RegionMap:
    rows, cols = draw(st.integers(1, 7)), draw(st.integers(1, 8))
    line = st.lists(st.sampled_from("...#"), min_size=cols, max_size=cols).map("".join)
    return RegionMap.from_grid(draw(st.lists(line, min_size=rows, max_size=rows)))


DIVIDED = {
    "case study 1": """
        #############
        #aaaaaaa#bbb#
        #aaaaaaa#bbb#
        #aaa#aaaabbb#
        #aaaaaaa#bbb#
        #aaaaaaa#bbb#
        #############""",
    "case study 2": """
        #############
        #aaaaaaa#bbb#
        #aaaaaaaabbb#
        #aaa#aaa#bbb#
        #aaaaaaaabbb#
        #aaaaaaa#bbb#
        #############""",
    "case study 3": """
        #############
        #aaa#bbb#ccc#
        #aaa#bbb#ccc#
        #aaaabbbbccc#
        #aaa#bbb#ccc#
        #aaa#bbb#ccc#
        #############""",
    "a corridor is a cell": """
        aa###cc
        aabbbcc
        aa###cc""",
    "a deep doorway belongs to the first room": """
        aa##bb
        aaaabb
        aa##bb""",
    "a nook belongs to its room": """
        aa#a
        aaaa
        aaa#""",
    "tiles are divided by walls": """
        a#bcc
        a#bcc
        dddee""",
}


@pytest.mark.parametrize("claim", DIVIDED)
def test_a_map_is_divided_as_drawn(claim: str) -> None:
    drawn = DIVIDED[claim].split()
    grid = ["".join("#" if sign == "#" else "." for sign in row) for row in drawn]
    cells: dict[str, set[int]] = {}
    for region, sign in enumerate("".join(drawn)):
        cells.setdefault(sign, set()).add(region)
    cells.pop("#", None)
    world = RegionMap.from_grid(grid)
    found = tiles(world, 2, 3) if claim.startswith("tiles") else rooms(world)
    assert [set(cell) for cell in found.cells] == sorted(cells.values(), key=min)


@settings(max_examples=150)
@given(maps(), st.integers(1, 6), st.integers(1, 4), st.integers(1, 4))
def test_every_free_region_is_in_one_cell(
    world: RegionMap, most: int, height: int, width: int
) -> None:
    found = rooms(world)
    coarse = found.coarsened(most, world)
    for partition in (found, tiles(world, height, width), coarse):
        assert sorted(r for cell in partition.cells for r in cell) == list(world.free)
    assert len(coarse.cells) == min(most, len(found.cells))
    assert all(any(fine <= cell for cell in coarse.cells) for fine in found.cells)


def reached(steps: list[tuple[int, int]], start: set[int]) -> set[int]:
    graph = networkx.DiGraph(steps)
    return start.union(*(networkx.descendants(graph, pose) for pose in start if pose in graph))


@settings(max_examples=150)
@given(maps(), st.sampled_from(Mobility), st.integers(0, 10**6))
def test_closures_of_sets_are_those_of_single_steps(
    world: RegionMap, mobility: Mobility, seed: int
) -> None:
    graph, random = PoseGraph(world, mobility), Random(seed)
    poses = [*bits(graph.everywhere)]
    allowed, start = ({p for p in poses if random.random() < share} for share in (0.7, 0.1))
    steps = [(pose, step) for pose in poses for step in graph.steps(pose)]
    inside, whole = (sum(1 << pose for pose in chosen) for chosen in (allowed, start))
    into = [(pose, step) for pose, step in steps if step in allowed]
    back = [(step, pose) for pose, step in steps if pose in allowed]
    assert {*bits(graph.closure(whole, inside))} == reached(into, start)
    assert {*bits(graph.back(whole, inside))} == reached(back, start)


def visible(
    world: RegionMap, radius: float | None, closed: frozenset[int], source: int, target: int
) -> bool:
    """The definition of ``safenav.world.sight`` in whole numbers: a segment crosses a square if
    corners of the square lie on both of its sides."""
    if not (world.is_free(source) and world.is_free(target)):
        return False
    s, t = world.position(source), world.position(target)
    down, right = t[0] - s[0], t[1] - s[1]
    if radius is not None and down**2 + right**2 > radius**2:
        return False
    opaque = {world.position(region) for region in (world.walls | closed) - {source, target}}
    rows, cols = (range(min(pair), max(pair) + 1) for pair in zip(s, t, strict=True))

    def side(row: int, col: int) -> int:
        """On which side the south-eastern corner of a square is; 0: on the line."""
        found = (2 * (row - s[0]) + 1) * right - (2 * (col - s[1]) + 1) * down
        return (found > 0) - (found < 0)

    for row, col in opaque & {*product(rows, cols)}:
        if {-1, 1} <= {side(row - up, col - left) for up, left in product((0, 1), repeat=2)}:
            return False
    for row, col in product(rows[:-1], cols[:-1]):
        across = {(row, col + 1), (row + 1, col)}
        beside = across if down * right > 0 else {(row, col), (row + 1, col + 1)}
        if side(row, col) == 0 and beside <= opaque:
            return False
    return True


@settings(max_examples=150)
@given(maps(), st.sampled_from([1.0, 1.5, 2.0, 2.5, 4.0, None]), st.data())
def test_visibility_is_as_defined(
    world: RegionMap, radius: float | None, data: st.DataObject
) -> None:
    closed = data.draw(st.frozensets(st.integers(0, world.size - 1), max_size=3))
    sight = visible_from(world, radius, closed)
    for source in range(world.size):
        expected = {t for t in range(world.size) if visible(world, radius, closed, source, t)}
        assert {*bits(sight.mask(source))} == expected
        assert {t for t in range(world.size) if sight.sees(source, t)} == expected


@pytest.mark.parametrize("radius", [0.0, 0.9, -3.0, float("nan")])
def test_a_robot_that_cannot_see_its_neighbours_is_refused(radius: float) -> None:
    with pytest.raises(ValueError, match="vision radius"):
        visible_from(RegionMap.from_grid(["..."]), radius)
