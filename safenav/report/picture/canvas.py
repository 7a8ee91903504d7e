"""Pixels of successive pictures: the ground, which takes most of the time, is drawn once."""

from __future__ import annotations

import io

from PIL import Image

from safenav.report.picture.raster import rendered, widest
from safenav.report.picture.svg import Layers


class Canvas:
    """Draws pictures ``width`` pixels wide, or less for very high ones."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._drawn = ""
        self._ground = Image.new("RGBA", (0, 0))

    def show(self, layers: Layers) -> Image.Image:
        """Return another picture."""
        if self._drawn != layers.ground:
            self._drawn, self._ground = layers.ground, self._image(layers, layers.ground)
        moving = self._image(layers, layers.moving)
        return Image.alpha_composite(self._ground, moving).convert("RGB")

    def _image(self, layers: Layers, document: str) -> Image.Image:
        width = min(self._width, widest(layers.width, layers.height))
        return Image.open(io.BytesIO(rendered(document, width=width))).convert("RGBA")
