"""A writer of SVG elements, and text widths for the layout of legends.

The advance widths are those of DejaVu Sans, the font of PNG and GIF, which is wider than the
fallback fonts of other renderers: text that fits here fits everywhere."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

FONTS = Path(__file__).parent / "fonts"
"""DejaVu Sans, regular and bold (subsets), so that pixels are the same on every machine."""

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
    """Return the width of one line in the unit of ``size``."""
    units = sum(_REGULAR[ord(char) - 32] if 32 <= ord(char) < 127 else _OTHER for char in text)
    return units / 1000 * size * (_BOLD if bold else 1.0)


def wrapped(text: str, size: float, width: float, bold: bool = False) -> list[str]:
    """Return the text in lines no wider than ``width``, broken at spaces; a longer word is cut."""
    lines: list[str] = []
    for word in text.split():
        candidate = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(candidate, size, bold) <= width:
            lines[-1] = candidate
            continue
        while text_width(word, size, bold) > width and len(word) > 1:
            fits = next(
                n
                for n in range(len(word) - 1, 0, -1)
                if n == 1 or text_width(word[:n], size, bold) <= width
            )
            lines.append(word[:fits])
            word = word[fits:]
        lines.append(word)
    return lines or [""]


def number(value: float) -> str:
    """Return a number with at most two decimals, no trailing zeros."""
    return f"{value:.2f}".rstrip("0").rstrip(".") or "0"


def polyline(*points: tuple[float, float]) -> str:
    """Return the path of a line through points."""
    return "M" + "L".join(f"{number(x)},{number(y)}" for x, y in points)


class SvgWriter:
    """Collects elements in drawing order; ``document`` gives the picture."""

    def __init__(self) -> None:
        self._parts: list[str] = []

    def element(self, tag: str, content: str | None = None, /, **attributes: object) -> None:
        """Add one element with escaped content; ``_`` in attribute names means ``-``, and an
        attribute that is None is left out."""
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
        """Add one line of text with the baseline ``y``."""
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
        """Begin an element whose content follows, until it is closed."""
        self.element(tag, "", **attributes)
        self._parts[-1] = self._parts[-1].removesuffix(f"</{tag}>")

    def close(self, tag: str) -> None:
        self._parts.append(f"</{tag}>")

    def document(self, width: float, height: float, title: str, description: str) -> str:
        """Return the finished picture; title and description are for screen readers."""
        titles = (f"<title>{escape(title)}</title>", f"<desc>{escape(description)}</desc>")
        w, h = number(width), number(height)
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" '
            f'viewBox="0 0 {w} {h}" role="img" font-family={quoteattr(FAMILY)}>'
        )
        return "\n".join((head, *titles, *self._parts, "</svg>\n"))
