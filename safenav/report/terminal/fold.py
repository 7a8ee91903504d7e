"""Long lines on a terminal, broken between words."""

from __future__ import annotations

import shutil
import sys

import click


def terminal_width() -> int | None:
    """Return the width of the terminal; None where there is none."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


def folded(line: str, width: int | None, indent: int) -> list[str]:
    """Return a line in parts of at most ``width`` characters, all but the first one indented.
    Colours do not count; a word that is wider keeps its length."""
    if width is None or len(click.unstyle(line)) <= width:
        return [line]
    lines, used = [""], 0
    for number, word in enumerate(line.split(" ")):
        long = len(click.unstyle(word))
        if number and used + 1 + long > width and lines[-1].strip():
            lines.append(" " * indent)
            used = indent - 1
        elif number:
            lines[-1] += " "
        lines[-1] += word
        used += long + (1 if number else 0)
    return lines
