"""Progress of long syntheses on standard error."""

from __future__ import annotations

import sys

import click

from safenav.synthesis.request import SynthesisProgress


class WaitingLine:
    """An updated line on a terminal, else a line every ``EVERY`` seconds."""

    EVERY = 10
    """Seconds between lines if standard error is not a terminal."""

    def __init__(self) -> None:
        self._live = sys.stderr.isatty()
        self._shown = False
        self._last = 0

    def __call__(self, progress: SynthesisProgress) -> None:
        if progress.result is None:
            text = f"synthesizing {progress.robot}: {progress.seconds:.0f} s"
            if self._live:
                click.echo(f"\r\033[K{text}", nl=False, err=True)
                self._shown = True
            elif int(progress.seconds) // self.EVERY > self._last:
                self._last = int(progress.seconds) // self.EVERY
                click.echo(text, err=True)
        else:
            self._last = 0
            if self._shown:
                click.echo("\r\033[K", nl=False, err=True)
                self._shown = False
