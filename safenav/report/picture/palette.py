"""Colours of a film: one palette of exact colours for all its frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from PIL import Image

Ints = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.uint8]


CLEAR = 255
"""The colour number of unchanged pixels."""


class Palette:
    """The exact most frequent colours of some images, for similar images.

    The drawings have few plain colours and many blends at edges. Plain colours must stay exact and
    blends become the nearest colour; general quantizers guarantee neither.
    """

    def __init__(self, images: Sequence[Image.Image]) -> None:
        packed = np.concatenate([_packed(image).ravel() for image in images])
        colours, counts = np.unique(packed, return_counts=True)
        self._colours = colours[np.argsort(-counts, kind="stable")[:CLEAR]].astype(np.int64)
        self._numbers = np.zeros(1 << 24, dtype=np.uint16)
        """The number, from 1 on, of the colour nearest to each RGB colour; 0 until computed."""
        self._shown: Numbers | None = None

    def difference(self, image: Image.Image) -> tuple[Image.Image, tuple[int, int]] | None:
        """Return the part that differs from the previous image, and its corner (left, top); None if
        there is none."""
        numbers, shown = self._of(image), self._shown
        self._shown = numbers
        frame = numbers if shown is None else np.where(numbers == shown, CLEAR, numbers)
        frame = frame.astype(np.uint8)
        changed = frame != CLEAR
        rows, cols = np.flatnonzero(changed.any(1)), np.flatnonzero(changed.any(0))
        if rows.size == 0:
            return None
        corner = int(cols[0]), int(rows[0])
        return self._image(frame[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]), corner

    def _of(self, image: Image.Image) -> Numbers:
        packed = _packed(image)
        numbers = self._numbers[packed]
        if not numbers.all():
            for colour in np.unique(packed[numbers == 0]):
                away = _parts(self._colours) - _parts(np.array([colour], dtype=np.int64))
                self._numbers[colour] = int(np.argmin((away * away).sum(axis=1))) + 1
            numbers = self._numbers[packed]
        return (numbers - 1).astype(np.uint8)

    def _image(self, numbers: Numbers) -> Image.Image:
        result = Image.fromarray(np.ascontiguousarray(numbers), "P")
        result.putpalette([int(part) for part in _parts(self._colours).ravel()])
        return result


def _packed(image: Image.Image) -> npt.NDArray[np.uint32]:
    """Return each pixel as one number."""
    pixels = np.frombuffer(image.convert("RGBX").tobytes(), dtype=np.dtype("<u4"))
    packed: npt.NDArray[np.uint32] = pixels.reshape(image.height, image.width) & np.uint32(0xFFFFFF)
    return packed


def _parts(colours: Ints) -> Ints:
    """Return red, green and blue of packed colours, one row per colour."""
    return np.stack([colours & 255, colours >> 8 & 255, colours >> 16], axis=1)
