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
        packed = np.concatenate([self._packed(image).ravel() for image in images])
        colours, counts = np.unique(packed, return_counts=True)
        self._colours = colours[np.argsort(-counts, kind="stable")[:size]]
        self._nearest: dict[int, int] = {}

    def applied(self, image: Image.Image) -> Image.Image:
        found, where = np.unique(self._packed(image), return_inverse=True)
        table = np.array([self._index(int(colour)) for colour in found], dtype=np.uint8)
        result = Image.fromarray(table[where].reshape(image.height, image.width), "P")
        result.putpalette([int(part) for part in self._parts(self._colours).ravel()])
        return result

    def _index(self, colour: int) -> int:
        if colour not in self._nearest:
            away = self._parts(self._colours) - self._parts(np.array([colour]))
            self._nearest[colour] = int(np.argmin((away * away).sum(axis=1)))
        return self._nearest[colour]

    @staticmethod
    def _packed(image: Image.Image) -> Ints:
        """Return each pixel as one number."""
        pixels = np.asarray(image.convert("RGB"), dtype=np.int64)
        return (pixels[..., 0] << 16) | (pixels[..., 1] << 8) | pixels[..., 2]

    @staticmethod
    def _parts(colours: Ints) -> Ints:
        """Return red, green and blue of packed colours, one row per colour."""
        return np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1)
