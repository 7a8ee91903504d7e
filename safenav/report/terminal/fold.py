"""Long lines on a terminal, broken between words."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from typing import TextIO

import click

_EXCERPT = re.compile(r" *\d* \| ")
"""Start of a quoted line of a file in a message, and of the mark below it."""


def terminal_width(stream: TextIO | None = None) -> int | None:
    """Return the width in characters of the terminal that is ``stream`` (default: standard output);
    None if it is not a terminal."""
    if not (stream or sys.stdout).isatty():
        return None
    from shutil import get_terminal_size  # imported here: it loads the modules of all archives

    return get_terminal_size().columns


def echo_folded(lines: Iterable[str], err: bool = False) -> None:
    """Print lines, folded on a terminal; continued parts are indented by two more columns."""
    width = terminal_width(sys.stderr if err else sys.stdout)
    for line in lines:
        for part in folded(line, width, len(line) - len(line.lstrip()) + 2):
            click.echo(part, err=err)


def folded(line: str, width: int | None, indent: int) -> list[str]:
    """Return a line in parts of at most ``width`` characters, all but the first indented by
    ``indent``. Colours do not count; a longer word is not broken."""
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


def folded_message(message: str, width: int | None) -> str:
    """Return an error message with its lines folded, except quoted lines of a file."""
    parts = (
        [line] if _EXCERPT.match(line) else folded(line, width, 6) for line in message.split("\n")
    )
    return "\n".join(part for some in parts for part in some)
