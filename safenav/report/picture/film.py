"""Runs as animated GIFs, by Pillow (extra ``pictures``)."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Callable, Iterable
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from safenav.errors import UsageError, needing
from safenav.report.picture.scene import Layer, sprites, svg_of
from safenav.report.picture.svg import png_of, size_of
from safenav.run.run import Run
from safenav.run.values import StoryKind

if TYPE_CHECKING:
    from PIL import Image

_HALTS = {StoryKind.VIOLATION, StoryKind.REQUEST, StoryKind.RESOLVED, StoryKind.BLOCKED}
PAUSE = 0.1
"""Seconds between frames, except where the animation rests."""
MOST_FRAMES = 2000
"""Maximum number of frames, which are in memory until the file is written."""
APART = 7
"""Minimum difference (of 256) of two distinct colours in red, green or blue."""
MOST_COLOURS = 1 << 18
"""Maximum number of colours of a frame, above that of any drawing: Pillow reserves memory for
them."""
CAPTION = 8
"""Ticks for which a caption stays unless another follows; later it would be outdated."""
_CAPTIONS = _HALTS | {StoryKind.ASSUMPTION, StoryKind.OUTCOME}


class Film:
    """The frames of a run. ``speed``: ticks per second, or a multiple of the speed of the run's
    clock."""

    def __init__(self, run: Run, speed: float = 4.0, width: int = 720) -> None:
        self._run, self._width = run, width
        self._ticks = ticks = range(run.last + 1)
        self._still: tuple[tuple[int, str], Image.Image] | None = None
        """The picture without the robots of a tick and its caption."""
        self._halts = {e.tick for e in run.events if e.kind in _HALTS and e.tick in ticks}
        begin, pause = run.time(ticks[0]), PAUSE * speed
        count = int((run.time(ticks[-1]) - begin) / pause + 1e-9) + 1
        found = {run.moment(begin + pause * number) for number in range(count)}
        found |= {(tick, 0.0) for tick in (*self._halts, ticks[-1])}
        self.moments = sorted(found)
        """The tick and elapsed fraction until the next tick of each frame and of each moment at
        which the animation rests."""

    def write_gif(self, path: Path, progress: Callable[[], None] | None = None) -> None:
        """Write an animated GIF, which rests at discoveries, requests and resolutions. ``progress``
        is called after each frame.

        Raises UsageError for more than ``MOST_FRAMES`` frames, or without the extra
        ``pictures``."""
        with needing("GIF (not SVG)", "pictures", "pillow"):
            from PIL import Image
        if (count := len(self.moments)) > MOST_FRAMES:
            problem = f"a GIF of {count} frames is too large: at most {MOST_FRAMES}"
            raise UsageError(f"{problem}\n    choose a higher --speed")
        colours = self._colours()
        frames: list[Image.Image] = []
        durations: list[int] = []
        for tick, part, caption, milliseconds in self._captioned():
            image = self._frame(tick, part, caption)
            frames.append(image.quantize(palette=colours, dither=Image.Dither.NONE))
            durations.append(milliseconds)
            if progress is not None:
                progress()
        more = {"save_all": True, "append_images": frames[1:], "duration": durations, "loop": 0}
        frames[0].save(path, "GIF", **more)

    def _frame(self, tick: int, part: float, caption: str) -> Image.Image:
        """Return the frame of a moment: a ``part`` (0 to 1) of the time from ``tick`` to the next.
        Pictures are drawn once per tick. Between two ticks, robots are placed on them."""
        (ground, zoom), at = self._ground, (tick, caption)
        if self._still is None or self._still[0] != at:
            marks = svg_of(self._run, tick, caption=caption, layers=[Layer.MARKS])
            image = ground.copy()
            image.alpha_composite(_drawn(marks, self._width))
            self._still = at, image
        frame = self._still[1].copy()
        for drawing, x, y in sprites(self._run, tick, part):
            image = _sprite(drawing, max(1, round(zoom * size_of(drawing)[0])))
            frame.alpha_composite(image, (max(0, round(zoom * x)), max(0, round(zoom * y))))
        return frame.convert("RGB")

    @cached_property
    def _ground(self) -> tuple[Image.Image, float]:
        """The picture of the ground and the number of pixels per unit of pictures."""
        ground = svg_of(self._run, self._ticks[0], caption="", layers=[Layer.GROUND])
        return _drawn(ground, self._width), self._width / size_of(ground)[0]

    def _captioned(self) -> Iterable[tuple[int, float, str, int]]:
        """Yield each frame's moment (tick and part), caption and duration in milliseconds."""
        first, last = self._ticks[0], self._ticks[-1]
        milliseconds = round(1000 * PAUSE)
        caption, since, shown = "", first, first - 1
        for tick, part in self.moments:
            halt = 0
            if tick > shown:
                passed = range(shown + 1, tick + 1)
                events = [event for now in passed for event in self._run.happened(now)]
                texts = [event.text for event in events if event.kind in _CAPTIONS]
                if texts:
                    caption, since = "; ".join(texts) + ".", tick
                elif tick - since > CAPTION:
                    caption = ""
                halt = 1200 if any(event.kind in _HALTS for event in events) else 0
                halt = 2500 if tick == last else halt
                shown = tick
            yield tick, part, caption, milliseconds + halt

    def _colours(self) -> Image.Image:
        """Return a palette for all frames: the most frequent colours of some moments. Plain colours
        stay exact, and a frame contains only changed pixels. Pillow may confuse colours that are
        nearer to each other than ``APART``."""
        from PIL import Image

        ticks = sorted({self._ticks[0], self._ticks[-1], *self._halts})
        counts: Counter[tuple[int, int, int]] = Counter()
        for tick in ticks[:: max(1, len(ticks) // 8)]:
            for count, colour in self._frame(tick, 0.0, "-").getcolors(MOST_COLOURS) or ():
                if isinstance(colour, tuple):
                    red, green, blue = colour
                    counts[red, green, blue] += count
        chosen: list[tuple[int, int, int]] = []
        for (red, green, blue), _ in counts.most_common(1024):
            if all(
                abs(red - r) > APART or abs(green - g) > APART or abs(blue - b) > APART
                for r, g, b in chosen
            ):
                chosen.append((red, green, blue))
        palette = Image.new("P", (1, 1))
        palette.putpalette(b"".join(map(bytes, chosen[:256])))
        return palette


def _drawn(svg: str, width: int) -> Image.Image:
    from PIL import Image

    return Image.open(io.BytesIO(png_of(svg, width))).convert("RGBA")


_sprite = lru_cache(maxsize=4096)(_drawn)
