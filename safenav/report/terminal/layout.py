"""Tables and progress reports as lines on a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from safenav.synthesis.slugs import SynthesisProgress


def echo_lines(lines: Iterable[str], err: bool = False) -> None:
    """Print lines."""
    for line in lines:
        click.echo(line, err=err)


def table(headings: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return the lines of a table. A dash represents None; columns of numbers are right-aligned."""
    cells = [["-" if value is None else str(value) for value in row] for row in rows]
    numeric = [
        all(isinstance(row[i], int | float) or row[i] is None for row in rows)
        for i in range(len(headings))
    ]
    widths = [max(len(line[i]) for line in [list(headings), *cells]) for i in range(len(headings))]
    lines = []
    for line in [list(headings), *cells]:
        padded = (
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(line, widths, numeric, strict=True)
        )
        lines.append("  ".join(padded).rstrip())
    lines.insert(1, "  ".join("-" * width for width in widths))
    return lines


class StatusLine:
    """Progress on standard error: an updated line on a terminal, otherwise a line every ``EVERY``
    seconds."""

    EVERY = 10.0
    """Seconds between lines if standard error is not a terminal."""

    def __init__(self) -> None:
        self.live = sys.stderr.isatty()
        self.last, self._shown = 0.0, False

    def show(self, text: str, seconds: float) -> None:
        """Show ``text`` as the state of work that began ``seconds`` ago."""
        if self.live:
            width = os.get_terminal_size(sys.stderr.fileno()).columns or 80
            click.echo(f"\r\033[K{text[: width - 1]}", nl=False, err=True)
            self._shown = True
        elif seconds - self.last >= self.EVERY:
            self.last = seconds
            click.echo(text, err=True)

    def clear(self) -> None:
        """Remove the line to make room for other output."""
        if self._shown:
            click.echo("\r\033[K", nl=False, err=True)
            self._shown = False


class WaitingLine(StatusLine):
    """A status line with the progress of a running synthesis."""

    def __call__(self, progress: SynthesisProgress) -> None:
        if progress.result is None:
            text = f"synthesizing {progress.robot}: {progress.seconds:.0f} s"
            self.show(text, progress.seconds)
        else:
            self.last = 0.0
            self.clear()
