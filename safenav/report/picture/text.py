"""Width of a text, so that a legend can be laid out before it is rendered.

The advance widths are those of DejaVu Sans, which PNG and GIF are rendered with and which is wider
than what other renderers fall back to: text that fits here fits everywhere."""

from __future__ import annotations

from pathlib import Path

FONTS = Path(__file__).parent / "fonts"
"""DejaVu Sans, regular and bold (subsets): pixels look the same on every machine."""

FAMILY = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"

# Widths in thousandths of the size for the characters from space to tilde.
_REGULAR = (
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337,
    636, 636, 636, 636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531,
    1000, 684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656, 557, 863, 748, 787,
    603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390, 337, 390, 838, 500,
    500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612,
    635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
)  # fmt: skip
_OTHER = 1000
_BOLD = 1.13  # no character of the bold face is relatively wider by more, on average


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
