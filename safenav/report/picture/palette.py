"""Colours of a film: one palette of exact colours for all its frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from PIL import Image

Ints = npt.NDArray[np.int64]


class Palette:
    """The most frequent colours of some images, exactly, for images like them.

    Our drawings have few plain colours and many blends at edges. The plain ones must stay as
    they are and blends may go to the nearest; general quantizers promise neither.
    """

    def __init__(self, images: Sequence[Image.Image], size: int = 256) -> None:
        packed = np.concatenate([_packed(image).ravel() for image in images])
        colours, counts = np.unique(packed, return_counts=True)
        self._colours = colours[np.argsort(-counts, kind="stable")[:size]].astype(np.int64)
        self._numbers = np.zeros(1 << 24, dtype=np.uint16)
        """The number of the nearest colour of each one, from 1 on; 0 until it is looked for."""

    def blank(self, size: tuple[int, int]) -> Image.Image:
        image = Image.new("P", size)
        image.putpalette([int(part) for part in _parts(self._colours).ravel()])
        return image

    def applied(self, image: Image.Image) -> Image.Image:
        packed = _packed(image)
        numbers = self._numbers[packed]
        if not numbers.all():
            for colour in np.unique(packed[numbers == 0]):
                away = _parts(self._colours) - _parts(np.array([colour], dtype=np.int64))
                self._numbers[colour] = int(np.argmin((away * away).sum(axis=1))) + 1
            numbers = self._numbers[packed]
        result = Image.fromarray((numbers - 1).astype(np.uint8), "P")
        result.putpalette(self.blank((1, 1)).getpalette() or [])
        return result


def _packed(image: Image.Image) -> npt.NDArray[np.uint32]:
    """Return each pixel as one number."""
    pixels = np.asarray(image.convert("RGB"), dtype=np.uint32)
    return pixels @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)


def _parts(colours: Ints) -> Ints:
    """Return red, green and blue of packed colours, one row per colour."""
    return np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1)
