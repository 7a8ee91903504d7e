"""What no picture of this machine shows: fonts and packages of other machines, films too large."""

import re
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

from report.runs import picture_of, run_of
from safenav import UsageError
from safenav.report.bag import write_mcap
from safenav.report.picture.film import Film
from safenav.report.picture.scene import svg_of
from safenav.report.picture.svg import png_of

resvg_py = pytest.importorskip("resvg_py", reason="PNG needs the extra `pictures` (resvg-py)")
ImageChops = pytest.importorskip("PIL.ImageChops")
Image = pytest.importorskip("PIL.Image", reason="GIF needs the extra `pictures` (pillow)")


@pytest.mark.parametrize(("title", "own"), [("Übung → λ", True), ("№ 7", False), ("机器人", False)])
def test_letters_missing_in_the_fonts_are_drawn_by_the_system(
    monkeypatch: pytest.MonkeyPatch, title: str, own: bool
) -> None:
    """They are not left out."""
    asked, drawn = list[bool](), resvg_py.svg_to_bytes

    def watched(**options: Any) -> bytes:
        asked.append(options["skip_system_fonts"])
        return bytes(drawn(**options))

    monkeypatch.setattr(resvg_py, "svg_to_bytes", watched)
    png_of(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><text>{title}</text></svg>')
    assert asked == [own]


def test_a_frame_is_the_whole_picture_although_it_is_drawn_in_parts() -> None:
    run = run_of("door")
    film = Film(run, width=500)
    for tick, part, caption, _ in film._captioned():
        frame = film._frame(tick, part, caption)
    whole = Image.open(BytesIO(png_of(svg_of(run, tick, part, caption=caption), 500)))
    coarse = (each.convert("L").reduce(5) for each in (frame, whole))
    apart = ImageChops.difference(*coarse).histogram()
    assert sum(apart[40:]) == 0, "robots are placed to a pixel"


def test_a_caption_does_not_stay_until_the_next_event() -> None:
    captions = {tick: text for tick, _, text, _ in Film(run_of("door"))._captioned()}
    told = next(tick for tick, text in captions.items() if "resolves door" in text)
    assert captions[told + 8] == captions[told] and not captions[told + 9]


def test_a_caption_that_is_too_long_ends_in_dots() -> None:
    svg = svg_of(run_of("door"), 3, caption="one gate " * 60)
    lines = re.findall(r">([^<]*gate[^<]*)</text>", svg)
    assert len(lines) == 3 and [line.endswith(" ...") for line in lines] == [False, False, True]


def test_white_stays_white_in_a_large_gif(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pillow's own palettes hold other colours, in large pictures even another white."""
    white, path = Image.new("RGB", (4200, 4200), "white"), tmp_path / "white.gif"
    monkeypatch.setattr(Film, "_frame", lambda *_: white)
    film = Film(run_of("door"))
    del film.moments[1:]
    film.write_gif(path)
    gif = Image.open(BytesIO(path.read_bytes()))
    assert gif.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def test_pictures_that_are_too_large_are_refused(tmp_path: Path) -> None:
    svg, slow = picture_of("door", tmp_path).read_text(), Film(run_of("door"), 0.1)
    with pytest.raises(UsageError, match="more than 48,000,000 pixels; use at most --width"):
        png_of(svg, 8000)
    with pytest.raises(UsageError, match="a GIF of 4603 frames is too large: at most 2000"):
        slow.write_gif(tmp_path / "x.gif")


def test_a_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("resvg_py", "mcap.writer", "PIL"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match="resvg-py>="):
        png_of("<svg/>")
    with pytest.raises(UsageError, match="mcap"):
        write_mcap(tmp_path / "x.mcap", ())
    with pytest.raises(UsageError, match="pillow"):
        Film(run_of("door")).write_gif(tmp_path / "x.gif")
