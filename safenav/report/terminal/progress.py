"""Progress of long work on standard error: an updated line on a terminal, else a line every
``StatusLine.EVERY`` seconds."""

from __future__ import annotations

import shutil
import sys

import click

from safenav.synthesis.request import SynthesisProgress


class StatusLine:
    EVERY = 10.0
    """Seconds between lines if standard error is not a terminal."""

    def __init__(self) -> None:
        self.live = sys.stderr.isatty()
        self.last, self._shown = 0.0, False

    def show(self, text: str, seconds: float) -> None:
        """Show the state of the work after some seconds."""
        if self.live:
            width = shutil.get_terminal_size().columns - 1
            click.echo(f"\r\033[K{text[:width]}", nl=False, err=True)
            self._shown = True
        elif seconds - self.last >= self.EVERY:
            self.last = seconds
            click.echo(text, err=True)

    def clear(self) -> None:
        """Remove the line, to make room for other output."""
        if self._shown:
            click.echo("\r\033[K", nl=False, err=True)
            self._shown = False


class WaitingLine(StatusLine):
    """A listener of syntheses."""

    def __call__(self, progress: SynthesisProgress) -> None:
        if progress.result is None:
            text = f"synthesizing {progress.robot}: {progress.seconds:.0f} s"
            self.show(text, progress.seconds)
        else:
            self.last = 0.0
            self.clear()
