"""Pixels of successive pictures: only the parts that differ are drawn again.

Drawing the ground takes most of the time of a picture, and is done once. What has been added or
removed since the picture before is drawn coarsely, which shows where pixels differ; there
everything that may move is drawn onto the ground again.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from math import ceil

import numpy as np
import numpy.typing as npt
from PIL import Image

from safenav.report.picture.raster import rendered, widest
from safenav.report.picture.svg import FAMILY, Layers, number

Box = tuple[int, int, int, int]
"""Left, top, right and bottom, in pixels."""

_COARSE = 8
"""Side, in pixels, of the squares that are compared."""


class Canvas:
    """A canvas of ``width`` pixels. ``image``: the last shown picture."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._shown: Layers | None = None
        self._ground = self.image = Image.new("RGB", (0, 0))

    def show(self, layers: Layers) -> list[Box]:
        """Show another picture, and return where it differs."""
        before = self._shown
        self._shown = layers
        if before is None or before.ground != layers.ground:
            width = min(self._width, widest(layers.width, layers.height))
            height = max(1, ceil(width * ceil(layers.height) / ceil(layers.width)))
            whole = (0, 0, width, height)
            self._ground = Image.new("RGBA", whole[2:])
            self._ground = _drawn(layers, layers.ground, whole, self._ground.size)
            self.image = Image.new("RGB", whole[2:])
            boxes = [whole]
        else:
            boxes = self._different(before, layers)
        for box in boxes:
            # Thin lines differ at the edge of the drawn part.
            wide = (box[0] - _COARSE, box[1] - _COARSE, box[2] + _COARSE, box[3] + _COARSE)
            above = _drawn(layers, self._within(layers, wide), wide, self._ground.size)
            patch = Image.alpha_composite(self._ground.crop(wide), above)
            inner = patch.crop((_COARSE, _COARSE, patch.width - _COARSE, patch.height - _COARSE))
            self.image.paste(inner.convert("RGB"), box[:2])
        return boxes

    def _within(self, layers: Layers, box: Box) -> list[str]:
        """Return the moving elements, without texts outside a box: even there letters take time."""
        x = ceil(layers.width) / self._ground.width
        y = ceil(layers.height) / self._ground.height
        begin_x, end_x = (part * x - layers.corner[0] for part in (box[0], box[2]))
        begin_y, end_y = (part * y - layers.corner[1] for part in (box[1], box[3]))

        def beside(line: str) -> bool:
            if line not in layers.texts:
                return False
            left, top, right, bottom = layers.texts[line]
            return right < begin_x or left > end_x or bottom < begin_y or top > end_y

        return _grouped(layers, [line for line in layers.moving if not beside(line)])

    def _different(self, before: Layers, after: Layers) -> list[Box]:
        changed: list[str] = []
        matcher = SequenceMatcher(None, before.moving, after.moving, autojunk=False)
        for tag, a, b, c, d in matcher.get_opcodes():
            if tag != "equal":
                changed += [*before.moving[a:b], *after.moving[c:d]]
        if not changed:
            return []
        patterns = [line for line in after.moving if line.startswith("<pattern")]
        width, height = self._ground.size
        coarse = (-(-width // _COARSE), -(-height // _COARSE))
        whole = (0, 0, coarse[0] * _COARSE, coarse[1] * _COARSE)
        marks = _grouped(after, [*patterns, *changed])
        seen = np.asarray(_drawn(after, marks, whole, self._ground.size, coarse))[..., 3] > 0
        touched = np.pad(seen, 1)
        for axis in (0, 1):  # an edge may be too faint to be found
            touched |= np.roll(touched, 1, axis) | np.roll(touched, -1, axis)
        return [
            (left, top, min(right, width), min(bottom, height))
            for left, top, right, bottom in (
                tuple(_COARSE * part for part in box) for box in _islands(touched[1:-1, 1:-1])
            )
        ]


def _grouped(layers: Layers, lines: Sequence[str]) -> list[str]:
    x, y = layers.corner
    return [f'<g transform="translate({number(x)} {number(y)})">', *lines, "</g>"]


def _drawn(
    layers: Layers,
    lines: Sequence[str],
    box: Box,
    size: tuple[int, int],
    pixels: tuple[int, int] | None = None,
) -> Image.Image:
    """Return a part, transparent where it is empty, of a picture of ``size`` pixels."""
    left, top, right, bottom = box
    across, down = pixels or (right - left, bottom - top)
    x, y = ceil(layers.width) / size[0], ceil(layers.height) / size[1]
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{across}" height="{down}" '
        f'viewBox="{left * x!r} {top * y!r} {(right - left) * x!r} {(bottom - top) * y!r}" '
        f'preserveAspectRatio="none" font-family="{FAMILY}">'
    )
    png = rendered("\n".join((svg, *lines, "</svg>")), zoom=1.0)
    return Image.open(io.BytesIO(png)).convert("RGBA")


def _islands(touched: npt.NDArray[np.bool_], x: int = 0, y: int = 0) -> Iterator[Box]:
    """Yield boxes around the true pixels, separated at empty rows and columns."""
    for axis in (0, 1):
        used = np.flatnonzero(touched.any(axis=1 - axis))
        parts = np.split(used, np.flatnonzero(np.diff(used) > 1) + 1)
        if used.size and (len(parts) > 1 or used.size < touched.shape[axis]):
            for part in parts:
                begin, end = int(part[0]), int(part[-1]) + 1
                if axis == 0:
                    yield from _islands(touched[begin:end], x, y + begin)
                else:
                    yield from _islands(touched[:, begin:end], x + begin, y)
            return
    if touched.any():
        yield x, y, x + touched.shape[1], y + touched.shape[0]
