"""A writer of SVG elements, text widths for the layout of legends, and glyphs, also for pages:
marks of states and events, silhouettes of obstacles.

The advance widths are those of DejaVu Sans, the font of PNG and GIF. It is wider than the fallback
fonts of other renderers, so text that fits here fits everywhere."""

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from math import cos, hypot, sin, tau
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from msgspec import Struct, json

from safenav.errors import UsageError, needing
from safenav.run.values import ObstacleStatus, StoryKind

FONTS = Path(__file__).parent / "fonts"
"""DejaVu Sans, regular and bold (subsets), for equal pixels on every machine."""

FAMILY = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"

# Widths of the characters from space to tilde, in thousandths of the font size.
_REGULAR = (
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337,
    636, 636, 636, 636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531,
    1000, 684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656, 557, 863, 748, 787,
    603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390, 337, 390, 838, 500,
    500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612,
    635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
)  # fmt: skip
_OTHER = 1000
_BOLD = 1.13  # width of a bold text relative to a regular one, rounded up


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Return the width of a line in the unit of ``size``."""
    units = sum(_REGULAR[ord(char) - 32] if 32 <= ord(char) < 127 else _OTHER for char in text)
    return units / 1000 * size * (_BOLD if bold else 1.0)


def wrapped(text: str, size: float, width: float, bold: bool = False) -> list[str]:
    """Return the text in lines of at most ``width``, broken at spaces. Cut longer words."""
    lines: list[str] = []
    for word in text.split():
        candidate = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(candidate, size, bold) <= width:
            lines[-1] = candidate
            continue
        while text_width(word, size, bold) > width and len(word) > 1:
            widths = (text_width(word[:n], size, bold) for n in range(2, len(word)))
            fits = 1 + sum(wide <= width for wide in widths)
            lines.append(word[:fits])
            word = word[fits:]
        lines.append(word)
    return lines or [""]


def number(value: float) -> str:
    """Return the text of a number with at most two decimals and no trailing zeros."""
    return f"{value:.2f}".rstrip("0").rstrip(".") or "0"


def polyline(*points: tuple[float, float]) -> str:
    """Return the data of an SVG path that connects points by lines."""
    return "M" + "L".join(f"{number(x)},{number(y)}" for x, y in points)


class SvgWriter:
    """Elements in drawing order; ``document`` returns the picture."""

    def __init__(self, parts: Iterable[str] = ()) -> None:
        self._parts = [*parts]

    def element(self, tag: str, content: str | None = None, /, **attributes: object) -> None:
        """Add an element with escaped content. ``_`` in attribute names means ``-``; attributes
        with the value None are omitted."""
        written = "".join(
            f" {name.rstrip('_').replace('_', '-')}="
            + (f'"{number(value)}"' if isinstance(value, float | int) else quoteattr(str(value)))
            for name, value in attributes.items()
            if value is not None
        )
        end = "/>" if content is None else f">{content}</{tag}>"
        self._parts.append(f"<{tag}{written}{end}")

    def rect(self, x: float, y: float, width: float, height: float, **attributes: object) -> None:
        self.element("rect", **{"x": x, "y": y, "width": width, "height": height, **attributes})

    def path(self, data: str, **attributes: object) -> None:
        self.element("path", **{"d": data, **attributes})

    def text(
        self, x: float, y: float, words: str, size: float, bold: bool = False, **attributes: object
    ) -> None:
        """Add one line of text. ``y``: its baseline."""
        font = {"font_size": size, "font_weight": "bold" if bold else None}
        self.element("text", escape(words), **{"x": x, "y": y, **font, **attributes})

    def glyph(
        self, path: str, x: float, y: float, radius: float, turn: float = 0, **attributes: object
    ) -> None:
        """Add a path in unit coordinates, placed around (x, y) and turned clockwise by degrees."""
        transform = f"translate({number(x)} {number(y)})"
        transform += f" rotate({number(turn)})" if turn else ""
        transform += f" scale({number(radius)})"
        self.path(path, transform=transform, fill_rule="evenodd", **attributes)

    def open(self, tag: str, /, **attributes: object) -> None:
        """Begin an element. Further elements are its content until it is closed."""
        self.element(tag, "", **attributes)
        self._parts[-1] = self._parts[-1].removesuffix(f"</{tag}>")

    def close(self, tag: str) -> None:
        self._parts.append(f"</{tag}>")

    def document(self, width: float, height: float, title: str = "") -> str:
        """Return the finished picture. The title is for screen readers."""
        w, h = number(width), number(height)
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" '
            f'viewBox="0 0 {w} {h}" role="img" font-family={quoteattr(FAMILY)}>'
        )
        return "\n".join((head, f"<title>{escape(title)}</title>", *self._parts, "</svg>\n"))


_SIZE = re.compile(r'viewBox="0 0 ([\d.]+) ([\d.]+)"')
_FOREIGN = re.compile(
    "[^\n -~\u00a0-\u017f\u0370-\u03ff\u2013\u2014\u2018-\u201d\u2022\u2026\u2190-\u2194"
    "\u2208\u220b\u221e\u2264\u2265\u25a1\u25cb\u25cf\u2713\u2717]"
)
"""The pattern of characters that the shipped fonts lack."""
MOST_PIXELS = 48_000_000
"""Maximum number of pixels of a picture, at about 17 bytes per pixel."""
QUICK = 1_000_000
"""Pixels of a picture that takes less than a second."""
_PROGRAM = """import json, resvg_py, sys
sys.stdout.buffer.write(bytes(resvg_py.svg_to_bytes(**json.load(sys.stdin.buffer))))"""
ZOOM, WIDE = 2.0, 2000
"""Pixels per unit of a picture, and its width in pixels, unless the user gives a width."""


def png_of(svg: str, width: int | None = None) -> bytes:
    """Return the picture as PNG, ``width`` pixels wide; by default with ``ZOOM`` pixels per unit,
    and at most ``WIDE`` pixels wide.

    Raises UsageError without the extra ``pictures`` or for too many pixels."""
    with needing("PNG (not SVG)", "pictures", "resvg-py"):
        from resvg_py import svg_to_bytes
    across, down = size_of(svg)
    most = int((MOST_PIXELS * across / down) ** 0.5)
    if width is not None and width > most:
        what = f"--width {width} makes a picture of more than {MOST_PIXELS:,} pixels"
        raise UsageError(f"{what}; use at most --width {most}, or SVG")
    zoom = min(ZOOM, min(most, WIDE) / across)
    order: dict[str, Any] = {
        "svg_string": svg,
        "width": width,
        "zoom": None if width else zoom,
        "skip_system_fonts": _FOREIGN.search(svg) is None,
        "font_files": [str(font) for font in sorted(FONTS.glob("*.ttf"))],
        "font_family": "DejaVu Sans",
        "sans_serif_family": "DejaVu Sans",
    }
    if (width or zoom * across) ** 2 * down / across < QUICK:
        return bytes(svg_to_bytes(**order))
    # resvg never returns to Python while it draws: only a separate process can be stopped.
    import subprocess

    command, given = [sys.executable, "-P", "-c", _PROGRAM], json.encode(order)
    return subprocess.run(
        command, input=given, stdout=subprocess.PIPE, check=True, start_new_session=True
    ).stdout


def size_of(svg: str) -> tuple[float, float]:
    """Return the width and height of a picture, in its units."""
    found = _SIZE.search(svg)
    assert found is not None
    return float(found[1]), float(found[2])


class Mark(Struct, frozen=True):
    """A glyph with its colour."""

    path: str
    colour: str


class Glyphs(Struct, frozen=True):
    """SVG paths in [-1, 1] squared, y downwards, filled by the even-odd rule. The shapes repeat the
    meaning of colours. ``nose``: a heading, to the north, outside the body; ``charger``: a region
    where batteries are charged; ``obstacles``: silhouettes by type; ``opened``: those of resolved
    doors."""

    nose: str
    charger: str
    obstacles: Mapping[str, str]
    opened: Mapping[str, str]
    status: Mapping[ObstacleStatus, Mark]
    events: Mapping[StoryKind, str]


GLYPHS = json.decode(Path(__file__).with_name("glyphs.json").read_bytes(), type=Glyphs)


def obstacle_pictogram(kind: str) -> str:
    """Return the silhouette of an obstacle type; empty if there is none."""
    return _found(GLYPHS.obstacles, kind)


def opened_pictogram(kind: str) -> str:
    """Return the silhouette of a resolved obstacle type."""
    return _found(GLYPHS.opened, kind) or obstacle_pictogram(kind)


def _found(paths: Mapping[str, str], name: str) -> str:
    """Return the path of ``name``, or of the longest known name that is its end after ``_`` or
    ``-`` (``fire_door``: that of ``door``); empty if there is none."""
    plain = name.replace("-", "_")
    fits = [known for known in paths if plain == known or plain.endswith(f"_{known}")]
    return paths[max(fits, key=len)] if fits else ""


def separated(places: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return offsets for each (row, col) that place robots over one another on a circle.

    The offsets change smoothly as robots approach within a region, so no robot jumps."""
    found = []
    for i, (row, col) in enumerate(places):
        near = [max(0.0, 1.0 - hypot(row - other[0], col - other[1])) for other in places]
        turn = tau * (0.125 + sum(near[:i]) / sum(near))
        far = 0.3 * min(1.0, sum(near) - 1.0)
        found.append((far * cos(turn), -far * sin(turn)))
    return found
