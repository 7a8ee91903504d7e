"""A run as an animated GIF, by Pillow (extra ``pictures``)."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from safenav.errors import UsageError
from safenav.extras import missing
from safenav.report.picture.raster import png_of
from safenav.report.picture.scene import Options, svg_of
from safenav.report.replay.perception import Shading, shading_of
from safenav.report.replay.timeline import Replay, StoryKind

if TYPE_CHECKING:
    from PIL import Image

_HALTS = {
    StoryKind.VIOLATION,
    StoryKind.REQUEST,
    StoryKind.RESOLVED,
    StoryKind.BLOCKED,
}
PAUSE = 0.125
"""Seconds between frames of a run with a clock."""
MOST_FRAMES = 2000
"""Limit of a film, whose frames are in memory until it is written."""
APART = 7
"""Difference of two colours in red, green or blue, of 256."""
_CAPTIONS = _HALTS | {StoryKind.ASSUMPTION, StoryKind.OUTCOME}


class Film(Struct, frozen=True):
    """Options of a film of a run: first and last tick, speed, smoothness, width. ``speed``: ticks
    per second, or a multiple of the speed of the run's clock. ``sight``: the robot whose sight and
    beliefs are shaded."""

    first: int
    last: int
    speed: float = 4.0
    steps: int = 3
    width: int = 720
    sight: str | None = None

    @property
    def ticks(self) -> range:
        return range(self.first, self.last + 1)

    def moments(self, replay: Replay) -> list[tuple[int, float]]:
        """Return the tick of each frame, and the elapsed part until the next tick. A run with a
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
    replay: Replay, path: Path, film: Film, progress: Callable[[], None] | None = None
) -> None:
    """Write the run as an animated GIF; it rests at discoveries, requests and resolutions.
    ``progress`` is called after each frame.

    Raises UsageError for more than ``MOST_FRAMES`` frames, or if the extra ``pictures`` is not
    installed."""
    try:
        from PIL import Image
    except ImportError as error:
        raise missing("GIF (not SVG)", "pillow", "pictures") from error
    if (count := len(film.moments(replay))) > MOST_FRAMES:
        problem = f"a GIF of {count} frames is too large: at most {MOST_FRAMES}"
        raise UsageError(
            f"{problem}\n    choose a part of the run (--ticks 0-100), or a higher --speed"
        )
    colours = _colours(replay, film)
    frames: list[Image.Image] = []
    durations: list[int] = []
    for tick, part, caption, milliseconds in _captioned(replay, film):
        image = _drawn(replay, film, tick, part, caption)
        frames.append(image.quantize(palette=colours, dither=Image.Dither.NONE))
        durations.append(milliseconds)
        if progress is not None:
            progress()
    more = {"save_all": True, "append_images": frames[1:], "duration": durations, "loop": 0}
    frames[0].save(path, "GIF", **more)


def _drawn(replay: Replay, film: Film, tick: int, part: float, caption: str) -> Image.Image:
    from PIL import Image

    options = Options(legend=False, caption=caption, shading=film.shading(replay, tick))
    pixels = png_of(svg_of(replay.scene(tick, part), options), film.width)
    return Image.open(io.BytesIO(pixels)).convert("RGB")


def _captioned(replay: Replay, film: Film) -> Iterable[tuple[int, float, str, int]]:
    """Yield the moments of the frames, with caption and duration in milliseconds."""
    pause = PAUSE if replay.times is not None else 1 / film.speed / film.steps
    milliseconds = max(20, round(100 * pause) * 10)
    caption, since, shown = "", film.first, film.first - 1
    for tick, part in film.moments(replay):
        halt = 0
        if tick > shown:
            events = [event for now in range(shown + 1, tick + 1) for event in replay.happened(now)]
            texts = [event.text for event in events if event.kind in _CAPTIONS]
            if texts:
                caption, since = ". ".join(texts) + ".", tick
            elif tick - since > 8:
                caption = ""
            halt = 1200 if any(event.kind in _HALTS for event in events) else 0
            halt = 2500 if tick == film.last else halt
            shown = tick
        yield tick, part, caption, milliseconds + halt


def _colours(replay: Replay, film: Film) -> Image.Image:
    """Return the most frequent colours of some moments as a palette for all frames: plain colours
    stay exact, and a frame holds only the pixels that changed. Pillow may confuse colours that are
    nearer to each other than ``APART``."""
    from PIL import Image

    halts = {e.tick for e in replay.events if e.kind in _HALTS and e.tick in film.ticks}
    ticks = sorted({film.first, film.last, *halts})
    counts: Counter[tuple[int, ...]] = Counter()
    for tick in ticks[:: max(1, len(ticks) // 8)]:
        image = _drawn(replay, film, tick, 0.0, "-")
        for count, colour in image.getcolors(1 << 24) or ():
            if isinstance(colour, tuple):  # of red, green and blue
                counts[colour] += count
    palette = Image.new("P", (1, 1))
    chosen: list[tuple[int, ...]] = []
    for colour, _ in counts.most_common(1024):
        if all(max(abs(a - b) for a, b in zip(colour, c, strict=True)) > APART for c in chosen):
            chosen.append(colour)
    palette.putpalette(b"".join(map(bytes, chosen[:256])))
    return palette
