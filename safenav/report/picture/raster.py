"""Pixels from the vector picture, by resvg.

resvg is an optional extra: a wheel that needs no system libraries. Its fonts are shipped with
safenav, so that a picture looks the same on every machine; only letters that they lack come from
the system's fonts.
"""

from __future__ import annotations

import re

from safenav.errors import UsageError
from safenav.extras import missing
from safenav.report.picture.svg import FONTS

_SIZE = re.compile(r'viewBox="0 0 ([\d.]+) ([\d.]+)"')
_FOREIGN = re.compile(
    "[^\n -~\u00a0-\u017f\u0370-\u03ff\u2013\u2014\u2018-\u201d\u2022\u2026\u2190-\u2194"
    "\u2208\u220b\u221e\u2264\u2265\u25a1\u25cb\u25cf\u2713\u2717]"
)
"""A letter that the shipped fonts lack."""
MOST_PIXELS = 48_000_000
"""Limit of a picture: drawing takes about 17 bytes per pixel."""
ZOOM, WIDE = 2.0, 2000
"""Pixels per unit of a picture, and its width in pixels, unless the user gives a width."""


def png_of(svg: str, width: int | None = None) -> bytes:
    """Return the picture as PNG, ``width`` pixels wide; by default with ``ZOOM`` pixels per unit,
    and at most ``WIDE`` pixels wide.

    Raises UsageError if the extra ``pictures`` is not installed, or for too many pixels."""
    try:
        import resvg_py
    except ImportError as error:
        raise missing("PNG (not SVG)", "resvg-py", "pictures") from error
    across, down = size_of(svg)
    most = int((MOST_PIXELS * across / down) ** 0.5)
    if width is not None and width > most:
        what = f"--width {width} makes a picture of more than {MOST_PIXELS:,} pixels"
        raise UsageError(f"{what}; use at most --width {most}, or SVG")
    pixels = resvg_py.svg_to_bytes(
        svg_string=svg,
        width=width,
        zoom=None if width else min(ZOOM, min(most, WIDE) / across),
        skip_system_fonts=_FOREIGN.search(svg) is None,
        font_files=[str(font) for font in sorted(FONTS.glob("*.ttf"))],
        font_family="DejaVu Sans",
        sans_serif_family="DejaVu Sans",
    )
    return bytes(pixels)


def size_of(svg: str) -> tuple[float, float]:
    """Return the width and height of a picture, in its units."""
    found = _SIZE.search(svg)
    assert found is not None
    return float(found[1]), float(found[2])
