"""A writer of SVG elements: nothing but what the pictures need."""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

from safenav.report.picture.text import FAMILY


def number(value: float) -> str:
    """Return a number with at most two decimals, no trailing zeros."""
    return f"{value:.2f}".rstrip("0").rstrip(".") or "0"


class SvgWriter:
    """Collects elements in drawing order; ``text`` gives the document."""

    def __init__(self) -> None:
        self._parts: list[str] = []

    def element(self, tag: str, content: str | None = None, /, **attributes: object) -> None:
        """Add one element, its content already escaped; ``_`` in attribute names stands for ``-``,
        None leaves an attribute out."""
        written = "".join(
            f" {name.rstrip('_').replace('_', '-')}="
            + quoteattr(number(value) if isinstance(value, float | int) else str(value))
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
        """Add one line of text, ``y`` being its baseline."""
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

    def open_group(self, **attributes: object) -> None:
        self.element("g", "", **attributes)
        self._parts[-1] = self._parts[-1].removesuffix("</g>")

    def close_group(self) -> None:
        self._parts.append("</g>")

    def document(self, width: float, height: float, title: str, description: str) -> str:
        """Return the finished picture; title and description are for screen readers."""
        w, h = number(width), number(height)
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" '
            f'viewBox="0 0 {w} {h}" role="img" font-family={quoteattr(FAMILY)}>\n'
            f"<title>{escape(title)}</title>\n<desc>{escape(description)}</desc>\n"
        )
        return head + "\n".join(self._parts) + "\n</svg>\n"
