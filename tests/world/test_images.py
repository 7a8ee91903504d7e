"""Map files: from bytes to pixels, and from pixels to regions. What a user sees of the files in
``tests/maps``: ``cli/transcripts/map_forms.txt``, ``maps.txt`` and ``broken_maps.txt``."""

import struct
import zlib
from fractions import Fraction
from math import ceil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safenav import InputError, RegionMap
from safenav.world.images import Blocked, Layout, crossed, read_image, read_movingai, walls
from support.examples import campaign

MAPS = Path(__file__).parents[1] / "maps"

images = st.tuples(st.integers(1, 7), st.integers(1, 7)).flatmap(
    lambda shape: st.lists(
        st.lists(st.booleans(), min_size=shape[1], max_size=shape[1]),
        min_size=shape[0],
        max_size=shape[0],
    ).map(np.array)
)
shares = st.sampled_from([0.0, 0.1, 0.25, 0.5, 0.75, 1.0])


def exact(blocked: Blocked, layout: Layout, share: float) -> frozenset[int]:
    """The rule in parts of pixels so small that no border of a region divides one."""
    (high, down), (wide, aside) = (
        side.as_integer_ratio() for side in (layout.height, layout.width)
    )
    free = ~np.repeat(np.repeat(blocked, down, axis=0), aside, axis=1)
    found = set()
    for region in range(layout.rows * layout.cols):
        row, col = divmod(region, layout.cols)
        south = free.shape[0] - (layout.rows - 1 - row) * high
        inside = free[max(0, south - high) : south, col * wide : (col + 1) * wide]
        part = 1 - Fraction(int(inside.sum()), high * wide)
        if part > 0 and part >= Fraction(str(share)):  # the number as it is written
            found.add(region)
    return frozenset(found)


@given(images, st.integers(1, 9), st.integers(1, 9), shares)
def test_a_count_of_rows_and_columns_divides_all_pixels(
    blocked: Blocked, rows: int, cols: int, share: float
) -> None:
    layout = Layout.of_count(blocked, rows, cols)
    assert layout.height * rows == len(blocked)
    assert walls(blocked, layout, share) == exact(blocked, layout, share)


@given(images, st.fractions(Fraction(1, 2), 9, max_denominator=20), shares)
def test_regions_of_a_size_begin_in_the_south_west(
    blocked: Blocked, side: Fraction, share: float
) -> None:
    layout = Layout.of_size(blocked, side)
    assert (layout.rows, layout.cols) == tuple(ceil(pixels / side) for pixels in blocked.shape)
    assert walls(blocked, layout, share) == exact(blocked, layout, share)


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


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG."""
    check = zlib.crc32(kind + data)
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)


HUGE = chunk(b"IHDR", struct.pack(">IIBBBBB", 9000, 9000, 1, 0, 0, 0, 0)) + chunk(b"IDAT", b"")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"P5 4 2 255\n" + b"\xff" * 9, "9 pixels where the header announces 8"),
        (b"P5 # from a robot\n4 2 255\n" + b"\xff" * 7, "7 pixels where the header announces 8"),
        (b"P5 4 2 9\n" + b"\x40" * 8, "pixels from 64 to 64 where the header announces 0 to 9"),
        (b"P5 2 2 65535\n" + b"\xff" * 9, "4.5 pixels where the header announces 4"),
        (b"P5 2 2 256\n" + b"\1\0" * 4, None),
        (b"\x89PNG\r\n\x1a\n" + chunk(b"teXt", b"\0\0\0\1" * 2) + HUGE, "an image of 9000 x 9000"),
    ],
    ids=["too many", "a comment", "too bright", "half a pixel", "two bytes", "a late header"],
)
def test_an_image_is_what_its_header_announces(data: bytes, words: str | None) -> None:
    """A header that lies would draw another map."""
    if words is None:
        assert read_image(data).brightness.tolist() == [[256, 256], [256, 256]]
        return
    with pytest.raises(InputError, match=words):
        read_image(data)


def damaged(data: bytes) -> st.SearchStrategy[bytes]:
    """The data with a few bytes changed, removed or added."""
    edit = st.tuples(st.integers(0, len(data)), st.integers(0, 5), st.binary(max_size=5))

    def apply(edits: list[tuple[int, int, bytes]]) -> bytes:
        found = data
        for at, removed, added in edits:
            found = found[:at] + added + found[at + removed :]
        return found

    return st.lists(edit, min_size=1, max_size=3).map(apply)


IMAGES = [
    (MAPS / name).read_bytes()
    for name in ("rooms.png", "rooms_16bit.png", "rooms_plain.pgm", "office.pgm", "rooms.pgm")
]


@campaign(150)
@given(st.sampled_from(IMAGES).flatmap(damaged) | st.binary(max_size=60))
def test_any_bytes_give_an_image_or_an_error(data: bytes) -> None:
    try:
        image = read_image(data)
    except InputError as error:
        assert error.diagnostics
        assert all(flaw.found for flaw in error.diagnostics)
    else:
        assert int(image.brightness.max()) <= image.white


@campaign(100)
@given(
    damaged((MAPS / "rooms.map").read_bytes()).map(lambda data: data.decode("latin-1"))
    | st.text(max_size=60)
)
def test_any_text_gives_a_movingai_map_or_an_error(text: str) -> None:
    try:
        rows = read_movingai(text)
    except InputError as error:
        assert error.diagnostics
        assert all(each.line <= len(text.splitlines()) + 1 for each in error.diagnostics)
    else:
        assert rows
        assert len({len(row) for row in rows}) == 1
