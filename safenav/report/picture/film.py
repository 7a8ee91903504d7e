"""A run as an animated GIF, by Pillow (extra ``pictures``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from safenav.extras import missing
from safenav.report.picture.scene import Options, layers_of
from safenav.report.picture.svg import Layers
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
PAUSE = 0.125
"""Seconds between frames of a run with a clock."""
_CAPTIONS = _HALTS | {StoryKind.ASSUMPTION, StoryKind.OUTCOME}


class Film(Struct, frozen=True):
    """Options of a film of a run: first and last tick, speed, smoothness, width. ``speed``: ticks
    per second, or a multiple of the speed of the run's clock."""

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

    def layers(self, replay: Replay, tick: int, part: float, caption: str) -> Layers:
        options = Options(legend=False, caption=caption, shading=self.shading(replay, tick))
        return layers_of(replay.scene(tick, part), options)


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
    from PIL import GifImagePlugin

    from safenav.report.picture.palette import CLEAR

    with path.open("wb") as file:
        for number, (image, corner, milliseconds) in enumerate(_frames(replay, film, progress)):
            if number == 0:
                header, _ = GifImagePlugin.getheader(image, info={"loop": 0})
                file.writelines(header)
            shown = {"duration": milliseconds, "transparency": CLEAR, "disposal": 1}
            file.writelines(GifImagePlugin.getdata(image, corner, **shown))
        file.write(b";")


def _frames(
    replay: Replay, film: Film, progress: Callable[[int], None] | None
) -> Iterator[tuple[Image.Image, tuple[int, int], int]]:
    """Yield the frames of a film: the part that differs from the previous frame, its corner, and
    its duration. A frame without a difference extends the previous one."""
    from safenav.report.picture.canvas import Canvas

    palette, canvas = _palette(replay, film), Canvas(film.width)
    held: tuple[Image.Image, tuple[int, int], int] | None = None
    for number, (layers, milliseconds) in enumerate(_moments(replay, film), start=1):
        found = palette.difference(canvas.show(layers))
        if held is not None and found is None:
            held = (held[0], held[1], held[2] + milliseconds)
        elif found is not None:
            if held is not None:
                yield held
            held = (*found, milliseconds)
        if progress is not None:
            progress(number)
    if held is not None:
        yield held


def _moments(replay: Replay, film: Film) -> Iterator[tuple[Layers, int]]:
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
        yield film.layers(replay, tick, part, caption), milliseconds + halt


def _palette(replay: Replay, film: Film) -> Palette:
    """Return one palette for all frames, from moments that together show every colour. With one
    palette, a frame needs only the pixels that changed."""
    from safenav.report.picture.canvas import Canvas
    from safenav.report.picture.palette import Palette

    ticks = {film.first, film.last}
    ticks |= {e.tick for e in replay.events if e.kind in _HALTS and e.tick in film.ticks}
    chosen = sorted(ticks)[:: max(1, len(ticks) // 8)]
    canvas = Canvas(film.width)
    return Palette([canvas.show(film.layers(replay, tick, 0.0, "-")) for tick in chosen])
