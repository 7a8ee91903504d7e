"""Visibility: the definition, compared with exact geometry in fractions."""

from collections.abc import Iterator
from fractions import Fraction
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from safenav.world.map import RegionMap
from safenav.world.poses import bits
from safenav.world.sight import visible_from

ROOMS = RegionMap.from_grid(
    [
        "#############",
        "#...#...#...#",
        "#...#...#...#",
        "#...........#",
        "#...#...#...#",
        "#...#...#...#",
        "#############",
    ]
)
RADII = st.sampled_from([1.0, 1.5, 2.0, 2.5, 4.0, None])


@st.composite
def maps(draw: st.DrawFn) -> RegionMap:
    rows, cols = draw(st.integers(1, 6)), draw(st.integers(1, 7))
    cell = st.sampled_from("...#")
    return RegionMap.from_grid(
        ["".join(draw(st.lists(cell, min_size=cols, max_size=cols))) for _ in range(rows)]
    )


@st.composite
def situations(draw: st.DrawFn) -> tuple[RegionMap, float | None, frozenset[int]]:
    world = draw(maps())
    closed = draw(st.frozensets(st.integers(0, world.size - 1), max_size=3))
    return world, draw(RADII), closed


def within_open_square(
    source: tuple[int, int], target: tuple[int, int], square: tuple[int, int]
) -> bool:
    """Whether the segment between two centres meets the interior of a unit square. Where both
    are on the map does not matter, so each situation is computed once."""
    row, col = source
    return _meets((target[0] - row, target[1] - col), (square[0] - row, square[1] - col))


@cache
def _meets(target: tuple[int, int], square: tuple[int, int]) -> bool:
    """The same for a segment from (0, 0): clip it by the four sides (Liang and Barsky 1984) and
    see whether more than a point is left."""
    enter, leave = Fraction(0), Fraction(1)
    for axis in (0, 1):
        length, low = target[axis], square[axis] - Fraction(1, 2)
        if length == 0:
            if not low < 0 < low + 1:
                return False
            continue
        ends = sorted((low / length, (low + 1) / length))
        enter, leave = max(enter, ends[0]), min(leave, ends[1])
    return enter < leave


def corners_hit(source: tuple[int, int], target: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """The corners exactly on the segment, as (row, col) of the square to their north-west."""
    for row in range(min(source[0], target[0]), max(source[0], target[0])):
        for col in range(min(source[1], target[1]), max(source[1], target[1])):
            to_corner = (row + Fraction(1, 2) - source[0], col + Fraction(1, 2) - source[1])
            to_target = (target[0] - source[0], target[1] - source[1])
            if to_corner[0] * to_target[1] == to_corner[1] * to_target[0]:
                yield row, col


def visible(
    world: RegionMap, radius: float | None, closed: frozenset[int], source: int, target: int
) -> bool:
    """The definition, word by word."""
    if not (world.is_free(source) and world.is_free(target)):
        return False
    s, t = world.position(source), world.position(target)
    if radius is not None and (s[0] - t[0]) ** 2 + (s[1] - t[1]) ** 2 > Fraction(radius) ** 2:
        return False
    opaque = {world.position(r) for r in (world.walls | closed) - {source, target}}
    if any(within_open_square(s, t, square) for square in opaque):
        return False
    for row, col in corners_hit(s, t):
        around = {(row + down, col + right) for down in (0, 1) for right in (0, 1)}
        beside = {square for square in around if not within_open_square(s, t, square)}
        assert len(beside) == 2
        if beside <= opaque:
            return False
    return True


@settings(max_examples=150)
@given(situations())
def test_visibility_agrees_with_exact_geometry(
    situation: tuple[RegionMap, float | None, frozenset[int]],
) -> None:
    world, radius, closed = situation
    sight = visible_from(world, radius, closed)
    for source in range(world.size):
        expected = {t for t in range(world.size) if visible(world, radius, closed, source, t)}
        assert {*bits(sight.mask(source))} == expected
        assert {t for t in range(world.size) if sight.sees(source, t)} == expected


@pytest.mark.parametrize("radius", [0.0, 0.9, -3.0, float("nan")])
def test_a_robot_that_cannot_see_its_neighbours_is_refused(radius: float) -> None:
    with pytest.raises(ValueError, match="vision radius"):
        visible_from(ROOMS, radius)
