"""From pixels to regions, against the same rule in exact fractions."""

from fractions import Fraction
from math import ceil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safenav.world.images import Blocked, Layout, crossed, walls
from safenav.world.map import RegionMap

images = st.tuples(st.integers(1, 7), st.integers(1, 7)).flatmap(
    lambda shape: st.lists(
        st.lists(st.booleans(), min_size=shape[1], max_size=shape[1]),
        min_size=shape[0],
        max_size=shape[0],
    )
)
shares = st.sampled_from([0.0, 0.1, 0.25, 0.5, 0.75, 1.0])


def shared(low: Fraction, high: Fraction, pixel: int) -> Fraction:
    """How much of the interval lies in the pixel."""
    return max(Fraction(0), min(high, Fraction(pixel + 1)) - max(low, Fraction(pixel)))


def exact(blocked: list[list[bool]], layout: Layout, share: float) -> frozenset[int]:
    """The rule of the module, one region and one pixel after the other."""
    pixels_down, pixels_aside = len(blocked), len(blocked[0])
    found = set()
    souths = [(layout.rows - 1 - row) * layout.height for row in range(layout.rows)]
    wests = [col * layout.width for col in range(layout.cols)]
    heights = [
        [shared(s, s + layout.height, pixels_down - 1 - y) for y in range(pixels_down)]
        for s in souths
    ]
    widths = [[shared(w, w + layout.width, x) for x in range(pixels_aside)] for w in wests]
    for row in range(layout.rows):
        for col in range(layout.cols):
            free = sum(
                height * width
                for y, height in enumerate(heights[row])
                for x, width in enumerate(widths[col])
                if height and width and not blocked[y][x]
            )
            part = 1 - free / (layout.height * layout.width)
            if part > 0 and part >= Fraction(str(share)):  # the number as it is written
                found.add(row * layout.cols + col)
    return frozenset(found)


@given(images, st.integers(1, 9), st.integers(1, 9), shares)
def test_a_count_of_rows_and_columns_divides_all_pixels(
    image: list[list[bool]], rows: int, cols: int, share: float
) -> None:
    blocked: Blocked = np.array(image)
    layout = Layout.of_count(blocked, rows, cols)
    assert layout.height * rows == len(image)
    assert walls(blocked, layout, share) == exact(image, layout, share)


@given(images, st.fractions(Fraction(1, 2), 9, max_denominator=20), shares)
def test_regions_of_a_size_begin_in_the_south_west(
    image: list[list[bool]], side: Fraction, share: float
) -> None:
    blocked: Blocked = np.array(image)
    layout = Layout.of_size(blocked, side)
    assert (layout.rows, layout.cols) == (ceil(len(image) / side), ceil(len(image[0]) / side))
    assert walls(blocked, layout, share) == exact(image, layout, share)


def test_a_single_blocked_pixel_makes_a_wall_unless_a_share_is_given() -> None:
    blocked: Blocked = np.zeros((8, 8), dtype=np.bool_)
    blocked[0, 7] = True
    layout = Layout.of_count(blocked, 2, 2)
    assert walls(blocked, layout) == {1}
    assert walls(blocked, layout, 1 / 16) == {1}
    assert walls(blocked, layout, 1 / 15) == frozenset()


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_large_images_are_divided(share: float) -> None:
    blocked: Blocked = np.zeros((4001, 3999), dtype=np.bool_)
    blocked[100:103] = True
    found = walls(blocked, Layout.of_count(blocked, 100, 100), share)
    assert found == (frozenset(range(200, 300)) if share == 0 else frozenset())


def test_a_wall_crosses_a_region_from_any_side() -> None:
    blocked: Blocked = np.zeros((8, 8), dtype=np.bool_)
    blocked[:, 1] = blocked[0, 5] = True
    world = RegionMap(2, 2, frozenset())
    for image, regions in ((blocked, [0, 2]), (blocked.T, [0, 1])):
        assert crossed(image, Layout.of_count(image, 2, 2), world) == regions
