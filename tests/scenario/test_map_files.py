"""Maps read from files: the real ones in tests/maps. Messages about broken ones:
``cli/transcripts/broken_maps.txt``."""

import builtins
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from once import beside, from_yaml
from safenav.errors import Diagnostic, InputError
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.world.images import read_image, read_movingai
from safenav.world.map import Frame, RegionMap
from support.examples import campaign

MAPS = Path(__file__).parents[1] / "maps"

ROOMS = [
    "#############",
    "#.......#...#",
    "#.......#...#",
    "#...#.......#",
    "#.......#...#",
    "#.......#...#",
    "#############",
]
ROBOTS = "robots: {ann: {model: quadcopter, start: %d, objective: {hold: %d}}}\n"


def load(written: str, start: int = 14) -> RegionMap:
    """The map of a scenario beside the maps; ``start`` is free on it."""
    text = f"safenav: 1\nmap: {{{written}}}\n" + ROBOTS % (start, start)
    return load_scenario_text(text, str(MAPS / "scenario.yaml")).map


def mistakes(written: str, start: int = 14) -> list[Diagnostic]:
    with pytest.raises(InputError) as caught:
        load(written, start)
    return list(caught.value.diagnostics)


@pytest.mark.parametrize(
    "written",
    [
        "image: rooms.png, rows: 7, cols: 13",
        "image: rooms_16bit.png, rows: 7, cols: 13",
        "image: rooms_palette.png, rows: 7, cols: 13",
        "image: rooms_transparent.png, rows: 7, cols: 13",
        "image: rooms_scanned.png, rows: 7, cols: 13, share: 0.3",
        "image: rooms.pgm, rows: 7, cols: 13",
        "image: rooms_16bit.pgm, rows: 7, cols: 13",
        "image: rooms_plain.pgm, rows: 7, cols: 13",
        "movingai: rooms.map",
        "movingai: rooms.map, rows: 7, cols: 13",
        "ros: office.yaml, rows: 7, cols: 13",
        "ros: office.yaml, resolution: 0.4",
        "ros: office_negated.yaml, resolution: 0.4",
    ],
)
def test_every_form_shows_the_same_rooms(written: str) -> None:
    assert load(written).grid_rows() == ROOMS


def test_a_file_outside_the_folder_is_reported_before_it_is_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "lab").mkdir()
    scenario = tmp_path / "lab" / "lab.yaml"
    for outside, file in ((False, "beside.map"), (True, "../there.map"), (True, "../gone.map")):
        caplog.clear()
        (tmp_path / "lab" / "beside.map").write_bytes((MAPS / "rooms.map").read_bytes())
        (tmp_path / "there.map").write_bytes((MAPS / "rooms.map").read_bytes())
        scenario.write_text(f"safenav: 1\nmap: {{movingai: {file}}}\nrobots: {{}}\n")
        with pytest.raises(InputError):
            load_scenario(scenario)
        told = [f"{scenario} reads a file outside of its folder" in m for m in caplog.messages]
        assert told == [True] * outside


def test_dust_and_walls_off_the_grid_are_walls_unless_a_share_is_given() -> None:
    found = load("image: rooms_scanned.png, rows: 7, cols: 13", 15).grid_rows()
    assert found[2] == "##...#..##..#", "dust in column 5, walls one pixel too far in the east"


def test_a_wall_that_a_share_removes_is_noted() -> None:
    assert load("image: rooms.png, rows: 7, cols: 13, share: 0.3").notes == ()
    (note,) = load("image: rooms.png, rows: 3, cols: 4, share: 0.9", 5).notes[:1]
    assert "a share of 0.9 removes a wall" in note


def test_a_file_may_be_divided_into_finer_regions() -> None:
    fine = load("movingai: rooms.map, rows: 14, cols: 26", 54).grid_rows()
    assert fine == [row for drawn in ROOMS for row in ["".join(2 * c for c in drawn)] * 2]


def test_a_ros_map_has_the_origin_of_its_file() -> None:
    by_size = load("ros: office.yaml, resolution: 0.4")
    assert by_size.frame == Frame((0.4, 0.4), (-2.5, -1.5), 0.0)
    by_count = load("ros: office.yaml, rows: 7, cols: 26", 28)
    assert by_count.frame is not None
    assert by_count.frame.resolution == pytest.approx((0.2, 0.4))
    x, y = by_size.frame.centre(*by_size.position(14), by_size.rows)
    assert (x, y) == pytest.approx((-2.5 + 0.6, -1.5 + 5.5 * 0.4))


def test_a_turned_ros_map() -> None:
    found = load("ros: office_negated.yaml, resolution: 0.4")
    assert found.frame is not None
    # a quarter turn: what was east is north, what was north is west
    assert found.frame.centre(6, 0, 7) == pytest.approx((1.0 - 0.2, 2.0 + 0.2))
    assert found.frame.centre(6, 12, 7) == pytest.approx((1.0 - 0.2, 2.0 + 5.0))


def test_regions_that_reach_beyond_a_ros_map_are_walls() -> None:
    found = load("ros: office.yaml, resolution: 0.5, share: 0.5", 12)
    assert (found.rows, found.cols) == (6, 11)
    assert all(found.region(row, 10) in found.walls for row in range(6))


def test_unknown_pixels_of_a_ros_map_are_walls(tmp_path: Path) -> None:
    (tmp_path / "three.pgm").write_text("P2 3 1 255\n0 205 254\n", encoding="ascii")
    settings = (
        "image: three.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: %d\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    nav2 = settings.replace("0.196", "0.25") % 0
    (tmp_path / "map.yaml").write_text(nav2, encoding="utf-8")
    text = "safenav: 1\nmap: {ros: map.yaml, resolution: 1}\n" + ROBOTS % (1, 2)
    read = load_scenario_text(text, str(tmp_path / "s.yaml")).map
    assert read.grid_rows() == ["#.."] and "gray 205 (1), which" in read.notes[0]
    for negate, expected in ((0, "##."), (1, ".##")):
        (tmp_path / "map.yaml").write_text(settings % negate, encoding="utf-8")
        free = expected.index(".")
        text = "safenav: 1\nmap: {ros: map.yaml, resolution: 1}\n" + ROBOTS % (free, free)
        found = load_scenario_text(text, str(tmp_path / "s.yaml")).map
        assert found.grid_rows() == [expected]


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG."""
    check = zlib.crc32(kind + data)
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)


PNG = b"\x89PNG\r\n\x1a\n"
HUGE = chunk(b"IHDR", struct.pack(">IIBBBBB", 9000, 9000, 1, 0, 0, 0, 0)) + chunk(b"IDAT", b"")


@pytest.mark.parametrize(
    ("header", "body", "words"),
    [
        (b"P5 4 2 255\n", b"\xff" * 9, "9 pixels where the header announces 8"),
        (b"P5 # from a robot\n4 2 255\n", b"\xff" * 7, "7 pixels where the header announces 8"),
        (b"P5 4 2 9\n", b"\x40" * 8, "pixels from 64 to 64 where the header announces 0 to 9"),
        (b"P5 2 2 65535\n", b"\xff" * 9, "4.5 pixels where the header announces 4"),
        (b"P2 4 2 9\n", b"9 " * 9, "9 pixels where the header announces 8"),
        (b"P2 4 2 9\n", b"9 # a row\n" * 9, "9 pixels where the header announces 8"),
        (b"P2 4 2 9\n", b"9 " * 7 + b"-1", "pixels from -1 to 9 where"),
        (b"P2 4 2 9\n", b"9 " * 7 + b"white", "not a number"),
        (b"P5 20000 20000 9\n", b"", "an image of 20000 x 20000 pixels; the maximum is"),
        (b"P5 0 5 255\n", b"", "an image of 0 x 5 pixels"),
        (b"P4 4 2\n", b"\x00\x00", "neither a PNG nor a PGM image"),
        (PNG, b"", "a broken image: not the header of a PNG"),
        (PNG + chunk(b"teXt", b"\0\0\0\1" * 2), HUGE, "an image of 9000 x 9000"),
    ],
)
def test_an_image_is_what_its_header_announces(
    header: bytes, body: bytes, words: str, tmp_path: Path
) -> None:
    """A header that lies would draw another map."""
    (tmp_path / "lie.pgm").write_bytes(header + body)
    text = "safenav: 1\nmap: {image: lie.pgm, rows: 1, cols: 2}\n" + ROBOTS % (0, 1)
    with pytest.raises(InputError, match=words):
        load_scenario_text(text, str(tmp_path / "s.yaml"))


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("grid: ['..'], resolution: 0.5", Frame((0.5, 0.5))),
        ("grid: ['..'], resolution: 2, origin: [-1, 3]", Frame((2.0, 2.0), (-1.0, 3.0))),
        ("grid: ['..'], resolution: 2, origin: [0, 0, 0.5]", Frame((2.0, 2.0), (0.0, 0.0), 0.5)),
        ("grid: ['..']", None),
    ],
)
def test_any_map_may_have_an_origin(written: str, expected: Frame | None) -> None:
    assert load(written, 0).frame == expected


WRONG_KEYS = from_yaml(beside(__file__, "map_keys.yaml"))


@pytest.mark.parametrize(("written", "words"), WRONG_KEYS)
def test_errors_in_the_keys_of_a_map_are_reported(written: str, words: str | None) -> None:
    found = mistakes(written, 0)
    told = " ".join(f"{d.found} {d.hint}" for d in found)
    assert words is None or re.search(words, told), told


def test_without_pillow_an_image_is_refused_with_the_extra_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real = builtins.__import__

    def refuse(name: str, *rest: Any, **options: Any) -> Any:
        if name == "PIL":
            raise ImportError(name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    (mistake,) = mistakes("image: rooms.png, rows: 7, cols: 13")
    assert "needs Pillow" in mistake.found
    assert "pip install 'numpy>=1.26' 'pillow>=10'" in mistake.hint


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
