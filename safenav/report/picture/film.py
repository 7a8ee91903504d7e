"""A run as an animated GIF, by Pillow (extra ``pictures``)."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from safenav.errors import UsageError, missing_package
from safenav.report.picture.scene import svg_of
from safenav.report.picture.svg import SvgWriter, png_of, size_of, text_width
from safenav.run.run import Run
from safenav.run.values import StoryKind

if TYPE_CHECKING:
    from PIL import Image

_HALTS = {
    StoryKind.VIOLATION,
    StoryKind.REQUEST,
    StoryKind.RESOLVED,
    StoryKind.BLOCKED,
}
PAUSE = 0.1
"""Seconds between frames, except where the film rests."""
MOST_FRAMES = 2000
"""Limit of a film, whose frames are in memory until it is written."""
APART = 7
"""Least difference of two distinct colours in red, green or blue, of 256."""
MOST_COLOURS = 1 << 18
"""Limit of the colours of a frame, above those of any drawing: Pillow reserves memory for that
many."""
CAPTION = 8
"""Ticks for which a caption stays, unless another one follows; later it would be out of date."""
Box = tuple[int, int, int, int]
"""Left, upper, right and lower edge, in pixels."""
_NUMBER = re.compile(r"-?\d+\.?\d*")
_ATTRIBUTE = re.compile(r' ([\w-]+)="([^"]*)"')
_AXES = re.compile(r"[MLH](-?\d+\.?\d*)"), re.compile(r"[,V](-?\d+\.?\d*)")
"""The indices of points in the data of a path."""
_CAPTIONS = _HALTS | {StoryKind.ASSUMPTION, StoryKind.OUTCOME}


class Film:
    """The frames of some ticks of a run. ``speed``: ticks per second, or a multiple of the speed of
    the run's clock."""

    def __init__(self, run: Run, ticks: range, speed: float = 4.0, width: int = 720) -> None:
        self._run, self._ticks, self._width = run, ticks, width
        self._marks: dict[str, Box] = {}
        """The elements of the last frame, each with the pixels that it may cover."""
        self._halts = {e.tick for e in run.events if e.kind in _HALTS and e.tick in ticks}
        begin, pause = run.time(ticks[0]), PAUSE * speed
        count = int((run.time(ticks[-1]) - begin) / pause + 1e-9) + 1
        found = {run.moment(begin + pause * number) for number in range(count)}
        found |= {(tick, 0.0) for tick in (*self._halts, ticks[-1])}
        self.moments = sorted(found)
        """The tick of each frame, and the elapsed fraction until the next tick; also each moment at
        which the film rests."""

    def write_gif(self, path: Path, progress: Callable[[], None] | None = None) -> None:
        """Write an animated GIF; it rests at discoveries, requests and resolutions. ``progress`` is
        called after each frame.

        Raises UsageError for more than ``MOST_FRAMES`` frames, or if the extra ``pictures`` is not
        installed."""
        try:
            from PIL import Image
        except ImportError as error:
            raise missing_package("GIF (not SVG)", "pillow", "pictures") from error
        if (count := len(self.moments)) > MOST_FRAMES:
            problem = f"a GIF of {count} frames is too large: at most {MOST_FRAMES}"
            raise UsageError(
                f"{problem}\n    choose a part of the run (--ticks 0-100), or a higher --speed"
            )
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
        """Return the frame of a moment: ``part`` is the elapsed fraction from ``tick`` to the next
        one. Only the places where it differs from the last frame are drawn, since the time goes
        into pixels."""
        ground, before = self._ground, self._marks
        moment = svg_of(self._run, tick, part, caption=caption, ground=False)
        zoom = ground.width / self._size[0], ground.height / self._size[1]
        self._marks = {mark: _pixels(box, zoom, ground.size) for mark, box in _boxed(moment)}
        changed = before.keys() ^ self._marks.keys()
        for place in _apart((before | self._marks)[mark] for mark in changed):
            group = f"translate({-place[0]} {-place[1]}) scale({zoom[0]} {zoom[1]})"
            inside = (mark for mark, box in self._marks.items() if _overlap(box, place))
            image = ground.crop(place)
            page = SvgWriter([f'<g transform="{group}">', *inside, "</g>"])
            image.alpha_composite(_drawn(page.document(*image.size, "", ""), image.width))
            self._shown.paste(image, place)
        return self._shown.convert("RGB")

    @cached_property
    def _ground(self) -> Image.Image:
        """The ground, which takes most of the time of a picture: it is drawn once."""
        ground = svg_of(self._run, self._ticks[0], caption="", moment=False)
        self._size, image = size_of(ground), _drawn(ground, self._width)
        self._shown = image.copy()
        return image

    def _captioned(self) -> Iterable[tuple[int, float, str, int]]:
        """Yield the moments of the frames, with caption and duration in milliseconds."""
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
        """Return the most frequent colours of some moments as a palette for all frames: plain
        colours stay exact, and a frame holds only the pixels that changed. Pillow may confuse
        colours that are nearer to each other than ``APART``."""
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


def _boxed(moment: str) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Yield the elements of a moment, each with the box that it may cover in the picture."""
    words, _, rest = moment.partition("<g ")
    group, _, drawing = rest.partition(">\n")
    for element in words.splitlines()[3:]:  # after the titles
        yield element, _box(element)
    dx, dy = map(float, _NUMBER.findall(group))
    for element in drawing.splitlines()[:-2]:
        left, upper, right, lower = _box(element)
        yield f"<g {group}>{element}</g>", (left + dx, upper + dy, right + dx, lower + dy)


def _box(element: str) -> tuple[float, ...]:
    """Return left, upper, right and lower edge of an element with its line, in its group."""
    of = dict(_ATTRIBUTE.findall(element))

    def value(*names: str) -> float:
        return sum(float(of.get(name, 0)) for name in names)

    x, y, wide, high = value("x", "cx"), value("y", "cy"), value("width"), value("height")
    around = 1 + value("r", "stroke-width")
    if place := of.get("transform"):  # a glyph
        x, y, *_, around = map(float, _NUMBER.findall(place))
        around *= 2
    elif data := of.get("d"):
        xs, ys = (sorted(map(float, axis.findall(data))) for axis in _AXES)
        x, y, wide, high = xs[0], ys[0], xs[-1] - xs[0], ys[-1] - ys[0]
    elif size := value("font-size"):
        wide, high = text_width(element.partition(">")[2], size, bold=True), 1.5 * size
        x, y = x - wide / 2 * ("text-anchor" in of), y - size
    return x - around, y - around, x + wide + around, y + high + around


def _pixels(box: tuple[float, ...], zoom: tuple[float, float], size: tuple[int, int]) -> Box:
    """Return the pixels of a box in a picture of a ``size``."""
    left, upper = (max(0, int(edge * by)) for edge, by in zip(box[:2], zoom, strict=True))
    ends = zip(box[2:], zoom, size, strict=True)
    right, lower = (min(most, int(edge * by) + 1) for edge, by, most in ends)
    return left, upper, right, lower


def _overlap(one: Box, other: Box) -> bool:
    return all(one[k] < other[k + 2] and other[k] < one[k + 2] for k in (0, 1))


def _apart(boxes: Iterable[Box]) -> list[Box]:
    """Return boxes of all these pixels, which do not overlap."""
    found: list[Box] = []
    for box in boxes:
        while near := [other for other in found if _overlap(box, other)]:
            found.remove(near[0])
            left, upper, right, lower = zip(box, near[0], strict=True)
            box = min(left), min(upper), max(right), max(lower)
        found.append(box)
    return found
