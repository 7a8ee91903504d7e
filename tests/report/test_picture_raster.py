"""PNG and GIF: real files in the right size, from the same drawing."""

import io
import sys
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.report.picture.film import Film
from safenav.report.picture.scene import svg_of
from safenav.report.picture.svg import png_of
from safenav.run.run import Run
from safenav.run.values import BLUE, ORANGE

resvg_py = pytest.importorskip("resvg_py", reason="PNG needs the extra `pictures` (resvg-py)")
Image = pytest.importorskip("PIL.Image", reason="GIF needs the extra `pictures` (pillow)")


def _colours(png: bytes) -> dict[tuple[int, int, int], int]:
    image = Image.open(io.BytesIO(png)).convert("RGB")
    return {colour: count for count, colour in image.getcolors(1 << 24)}


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))


def test_a_png_has_the_requested_width_and_shows_the_robots(replays: dict[str, Run]) -> None:
    png = png_of(svg_of(replays["door"], 11), width=900)
    assert Image.open(io.BytesIO(png)).size[0] == 900
    colours = _colours(png)
    assert colours.get(_rgb(BLUE), 0) > 300 and colours.get(_rgb(ORANGE), 0) > 300


@pytest.mark.parametrize(("title", "own"), [("Übung → λ", True), ("№ 7", False), ("机器人", False)])
def test_letters_missing_in_the_fonts_are_drawn_by_the_system(
    replays: dict[str, Run], monkeypatch: pytest.MonkeyPatch, title: str, own: bool
) -> None:
    """They were left out."""
    asked: list[bool] = []
    drawn = resvg_py.svg_to_bytes

    def watched(**options: Any) -> bytes:
        asked.append(options["skip_system_fonts"])
        return bytes(drawn(**options))

    monkeypatch.setattr(resvg_py, "svg_to_bytes", watched)
    png_of(svg_of(replace(replays["door"], name=title), 0), width=200)
    assert asked == [own]


def test_a_film_rests_at_events(replays: dict[str, Run], tmp_path: Path) -> None:
    path = tmp_path / "door.gif"
    frames: list[None] = []
    some = Film(replays["door"], range(9, 14), speed=4, width=400)
    some.write_gif(path, lambda: frames.append(None))
    assert len(frames) == len(some.moments)
    durations = []
    with Image.open(path) as gif:
        assert gif.size[0] == 400
        for i in range(gif.n_frames):
            gif.seek(i)
            durations.append(gif.info["duration"])
    assert sum(durations) == 11 * 100 + 1200 + 2500  # frames, the violation, the end
    assert max(durations[:-1]) >= 1200
    with Image.open(path) as gif:
        gif.seek(1)
        assert (gif.tile[0][1][2] - gif.tile[0][1][0]) < 400, "a frame holds only what differs"


def test_a_film_has_the_plain_colours_of_the_picture(
    replays: dict[str, Run], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pillow's own palettes hold other colours, in large pictures even another white."""
    path = tmp_path / "door.gif"
    Film(replays["door"], range(11, 12), width=400).write_gif(path)
    with Image.open(path) as gif:
        colours = {colour for _, colour in gif.convert("RGB").getcolors(256)}
    assert {_rgb(colour) for colour in ("#ffffff", BLUE, ORANGE)} <= colours
    white = Image.new("RGB", (4200, 4200), "white")
    monkeypatch.setattr(Film, "_frame", lambda *_: white)
    Film(replays["door"], range(11, 12)).write_gif(path)
    with Image.open(path) as gif:
        assert gif.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def test_a_missing_extra_is_named(
    replays: dict[str, Run], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    svg = svg_of(replays["door"], 0)
    monkeypatch.setitem(sys.modules, "resvg_py", None)
    with pytest.raises(UsageError, match="resvg-py>="):
        png_of(svg)
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(UsageError, match="pillow"):
        Film(replays["door"], range(2)).write_gif(tmp_path / "x.gif")
