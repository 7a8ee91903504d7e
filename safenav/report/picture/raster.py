"""Pixels from the vector picture: PNG through resvg, GIF through Pillow.

Both come from PyPI as wheels without system libraries, and are an optional extra. The fonts
are our own, so that a picture looks the same on every machine.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from safenav.errors import UsageError
from safenav.extras import missing
from safenav.report.picture.scene import Options, svg_of
from safenav.report.picture.svg import FONTS
from safenav.report.replay.perception import Shading, shading_of
from safenav.report.replay.timeline import Replay, StoryKind

if TYPE_CHECKING:
    from PIL import Image

    from safenav.report.picture.palette import Palette

_HALTS = {
    StoryKind.VIOLATION,
    StoryKind.REQUEST,
    StoryKind.RESOLVED,
    StoryKind.BLOCKED,
}
_SIZE = re.compile(r'viewBox="0 0 ([\d.]+) ([\d.]+)"')
MOST_PIXELS = 48_000_000
"""Drawing takes about 17 bytes for each."""
PAUSE = 0.125
"""Seconds of a frame of a run with a clock."""
_CAPTIONS = _HALTS | {StoryKind.ASSUMPTION, StoryKind.OUTCOME}


def png_of(svg: str, width: int | None = None, zoom: float = 2.0) -> bytes:
    """Return the picture in pixels: ``width`` of them across, or ``zoom`` for each unit, which is
    less for a very large picture.

    Raises UsageError if the extra ``pictures`` is not installed, or for too many pixels."""
    try:
        import resvg_py
    except ImportError as error:
        raise missing("PNG (not SVG)", "resvg-py", "pictures") from error
    units, most = _units(svg), _widest(svg)
    if width is not None and width > most:
        what = f"--width {width} makes a picture of more than {MOST_PIXELS:,} pixels"
        raise UsageError(f"{what}; use at most --width {most}, or SVG")
    zoom = min(zoom, most / units[0])
    pixels = resvg_py.svg_to_bytes(
        svg_string=svg,
        width=width,
        zoom=None if width else zoom,
        skip_system_fonts=True,
        font_files=[str(font) for font in sorted(FONTS.glob("*.ttf"))],
        font_family="DejaVu Sans",
        sans_serif_family="DejaVu Sans",
    )
    return bytes(pixels)


def _units(svg: str) -> tuple[float, float]:
    """Width and height of a picture in its own units."""
    found = _SIZE.search(svg)
    assert found is not None
    return float(found[1]), float(found[2])


def _widest(svg: str) -> int:
    """The most pixels across that a picture may have."""
    across, down = _units(svg)
    return int((MOST_PIXELS * across / down) ** 0.5)


class Film(Struct, frozen=True):
    """Options of a film of a run: first and last tick, speed, smoothness, width. ``speed``: ticks
    per second, or how many times as fast as its clock the run is shown."""

    first: int
    last: int
    speed: float = 4.0
    steps: int = 3
    width: int = 720
    sight: str | None = None
    """The robot whose sight and beliefs are shaded."""

    @property
    def ticks(self) -> range:
        return range(self.first, self.last + 1)

    def moments(self, replay: Replay) -> list[tuple[int, float]]:
        """Return the tick of each frame, and the part of the way to the next one. A run with a
        clock is shown every ``PAUSE`` seconds, and at each instant at which the film rests."""
        if replay.times is None:
            ticks = range(self.first, self.last)
            steps = [(tick, part / self.steps) for tick in ticks for part in range(self.steps)]
            return [*steps, (self.last, 0.0)]
        begin, end = replay.times[self.first], replay.times[self.last]
        count = int((end - begin) / (PAUSE * self.speed)) + 1
        found = {replay.moment(begin + PAUSE * self.speed * number) for number in range(count)}
        halts = {(e.tick, 0.0) for e in replay.events if e.kind in _HALTS and e.tick in self.ticks}
        return sorted(found | halts | {(self.last, 0.0)})

    def shading(self, replay: Replay, tick: int) -> Shading | None:
        return None if self.sight is None else shading_of(replay, self.sight, tick)


def write_gif(
    replay: Replay, path: Path, film: Film, progress: Callable[[int], None] | None = None
) -> None:
    """Write the run as an animated GIF; it rests at discoveries, requests and resolutions.

    ``progress`` receives the number of finished frames. Raises UsageError if the extra
    ``pictures`` is not installed."""
    try:
        import PIL.Image  # noqa: F401
    except ImportError as error:
        raise missing("GIF (not SVG)", "pillow", "pictures") from error
    images = []
    durations = []
    palette = _palette(replay, film)
    for svg, milliseconds in _frames(replay, film):
        images.append(palette.applied(_image(svg, film.width)))
        durations.append(milliseconds)
        if progress is not None:
            progress(len(images))
    images[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=images[1:],
        duration=durations,
        loop=0,
        optimize=False,
    )


def _frames(replay: Replay, film: Film) -> Iterator[tuple[str, int]]:
    pause = PAUSE if replay.times is not None else 1 / film.speed / film.steps
    milliseconds = max(20, round(100 * pause) * 10)
    caption, since, shown = "", film.first, film.first - 1
    for tick, part in film.moments(replay):
        halt = 0
        if tick > shown:
            events = [event for now in range(shown + 1, tick + 1) for event in replay.happened(now)]
            told = [event.text for event in events if event.kind in _CAPTIONS]
            if told:
                caption, since = ". ".join(told) + ".", tick
            elif tick - since > 8:
                caption = ""
            halt = 1200 if any(event.kind in _HALTS for event in events) else 0
            halt = 2500 if tick == film.last else halt
            shown = tick
        options = Options(legend=False, caption=caption, shading=film.shading(replay, tick))
        yield svg_of(replay.scene(tick, part), options), milliseconds + halt


def _palette(replay: Replay, film: Film) -> Palette:
    """Return one palette for all frames, from moments that together show every colour: with it, a
    frame needs to hold only what changed."""
    from safenav.report.picture.palette import Palette

    ticks = {film.first, film.last}
    ticks |= {e.tick for e in replay.events if e.kind in _HALTS and e.tick in film.ticks}
    chosen = sorted(ticks)[:: max(1, len(ticks) // 8)]
    images = []
    for tick in chosen:
        options = Options(legend=False, caption="-", shading=film.shading(replay, tick))
        images.append(_image(svg_of(replay.scene(tick), options), film.width))
    return Palette(images)


def _image(svg: str, width: int) -> Image.Image:
    from PIL import Image

    return Image.open(io.BytesIO(png_of(svg, min(width, _widest(svg))))).convert("RGB")
