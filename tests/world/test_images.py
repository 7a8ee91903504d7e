"""Map files: from bytes to pixels, and from pixels to regions. What a user sees of the files in
``tests/maps``: ``cli/transcripts/map_forms.txt``, ``maps.txt`` and ``broken_maps.txt``."""

import json
import struct
import zlib
from fractions import Fraction
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safenav import InputError, RegionMap, load_scenario_text
from support.examples import CHARACTERS, campaign

MAPS = Path(__file__).parents[1] / "maps"
Blocked = Any  # a numpy array of booleans, one row per row of pixels


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of map files, which each example writes anew."""
    found = tmp_path_factory.mktemp("maps")
    ros = "image: floor.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
    (found / "floor.yaml").write_text(f"{ros}occupied_thresh: 0.65\nfree_thresh: 0.2\n")
    return found


def loaded(folder: Path, start: int = 0, **keys: object) -> RegionMap:
    """The map of a scenario with a robot on it."""
    robot = {"model": "quadcopter", "start": start, "objective": {"hold": start}}
    data = {"safenav": 1, "map": keys, "robots": {"ann": robot}}
    return load_scenario_text(json.dumps(data), str(folder / "scenario.yaml")).map


def walls(blocked: Blocked, folder: Path, start: int, **keys: object) -> frozenset[int]:
    rows, cols = blocked.shape
    pixels = np.where(blocked, 0, 255).astype(np.uint8).tobytes()
    (folder / "floor.pgm").write_bytes(b"P5 %d %d 255\n" % (cols, rows) + pixels)
    return loaded(folder, start, **keys).walls


images = st.tuples(st.integers(1, 7), st.integers(1, 7)).flatmap(
    lambda shape: st.lists(
        st.lists(st.booleans(), min_size=shape[1], max_size=shape[1]),
        min_size=shape[0],
        max_size=shape[0],
    ).map(np.array)
)
shares = st.sampled_from([0.0, 0.1, 0.25, 0.5, 0.75, 1.0])


def exact(
    blocked: Blocked, rows: int, cols: int, height: Fraction, width: Fraction, share: float
) -> frozenset[int]:
    """The rule in parts of pixels so small that no border of a region divides one."""
    (high, down), (wide, aside) = (side.as_integer_ratio() for side in (height, width))
    free = ~np.repeat(np.repeat(blocked, down, axis=0), aside, axis=1)
    found = set()
    for region in range(rows * cols):
        row, col = divmod(region, cols)
        south = free.shape[0] - (rows - 1 - row) * high
        inside = free[max(0, south - high) : south, col * wide : (col + 1) * wide]
        part = 1 - Fraction(int(inside.sum()), high * wide)
        if part > 0 and part >= Fraction(str(share)):  # the number as it is written
            found.add(region)
    return frozenset(found)


def judge(blocked: Blocked, folder: Path, walled: frozenset[int], size: int, **keys: Any) -> None:
    """Check that these regions are walls; a map without a free region is refused."""
    start = min({*range(size)} - walled, default=0)
    try:
        assert walls(blocked, folder, start, **keys) == walled
    except InputError:
        assert len(walled) == size


@campaign(100)
@given(images, st.integers(1, 9), st.integers(1, 9), shares)
def test_rows_and_columns_divide_all_pixels_of_an_image(
    folder: Path, blocked: Blocked, rows: int, cols: int, share: float
) -> None:
    height, width = Fraction(blocked.shape[0], rows), Fraction(blocked.shape[1], cols)
    walled = exact(blocked, rows, cols, height, width, share)
    keys = {"image": "floor.pgm", "rows": rows, "cols": cols, "share": share}
    judge(blocked, folder, walled, rows * cols, **keys)


@campaign(100)
@given(images, st.fractions(Fraction(1, 2), 9, max_denominator=20), shares)
def test_regions_of_a_size_begin_in_the_south_west(
    folder: Path, blocked: Blocked, side: Fraction, share: float
) -> None:
    rows, cols = (ceil(pixels / side) for pixels in blocked.shape)
    walled = exact(blocked, rows, cols, side, side, share)
    keys = {"ros": "floor.yaml", "resolution": float(side), "share": share}
    judge(blocked, folder, walled, rows * cols, **keys)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_large_image_is_divided_exactly(folder: Path, share: float) -> None:
    blocked = np.zeros((4001, 3999), dtype=np.bool_)
    blocked[100:103] = True
    found = walls(blocked, folder, 0, image="floor.pgm", rows=100, cols=100, share=share)
    assert found == (frozenset(range(200, 300)) if share == 0 else frozenset())


def test_the_largest_maps_are_read(folder: Path) -> None:
    """A strip needs memory for its pixels only; 153.6 m are 512 regions of 0.3 m."""
    assert (
        walls(np.zeros((1, 100_000)), folder, 0, image="floor.pgm", rows=1, cols=100_000) == set()
    )
    tenth = (folder / "floor.yaml").read_text().replace("resolution: 1", "resolution: 0.1")
    (folder / "tenth.yaml").write_text(tenth)
    assert walls(np.zeros((1536, 1536)), folder, 0, ros="tenth.yaml", resolution=0.3) == set()


def test_a_wall_across_a_region_is_found_in_either_direction(folder: Path) -> None:
    blocked = np.zeros((8, 8), dtype=np.bool_)
    blocked[:, 1] = blocked[0, 5] = True
    for image, regions in ((blocked, "0 [0, 0] to 2 [1, 0]"), (blocked.T, "0 [0, 0] to 1 [0, 1]")):
        keys = {"image": "floor.pgm", "rows": 2, "cols": 2, "share": 0.5}
        assert walls(image, folder, 0, **keys) == frozenset()
        (note,) = loaded(folder, **keys).notes
        assert f"2 regions from {regions} are free although the image draws a wall across" in note


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
        (b"\x89PNG", "(?s)not the header of a PNG.*save it as PNG"),
        (b"\x89PNG\r\n\x1a\n" + chunk(b"teXt", b"\0\0\0\1" * 2) + HUGE, "an image of 9000 x 9000"),
    ],
    ids=[
        "too many",
        "a comment",
        "too bright",
        "half a pixel",
        "two bytes",
        "no header",
        "a late header",
    ],
)
def test_an_image_that_contradicts_its_header_is_refused(
    data: bytes, words: str | None, folder: Path
) -> None:
    """A header that lies would draw another map."""
    (folder / "floor").write_bytes(data)
    if words is None:
        assert loaded(folder, image="floor", rows=2, cols=2).walls == frozenset()
        return
    with pytest.raises(InputError, match=words):
        loaded(folder, image="floor", rows=2, cols=2)


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


DRAWN = (MAPS / "rooms.map").read_bytes()


@campaign(250)
@given(
    st.sampled_from(IMAGES).flatmap(damaged).map(lambda data: ("image", data))
    | st.binary(max_size=60).map(lambda data: ("image", data))
    | damaged(DRAWN).map(lambda data: ("movingai", data))
    | st.text(CHARACTERS, max_size=60).map(lambda text: ("movingai", text.encode()))
)
def test_any_bytes_give_a_map_or_an_error(folder: Path, drawn: tuple[str, bytes]) -> None:
    form, data = drawn
    (folder / "any").write_bytes(data)
    try:
        found = loaded(folder, **{form: "any", "rows": 1, "cols": 1, "share": 1})
    except InputError as error:
        for each in error.diagnostics:
            assert each.found and each.line <= data.count(b"\n") + data.count(b"\r") + 2
    else:
        assert (found.rows, found.cols, found.walls) == (1, 1, frozenset())
