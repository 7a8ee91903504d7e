"""Progress of a batch on standard error: an updated line on a terminal, else a line every
``ProgressLine.EVERY`` seconds; failures when they happen."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence

import click

from safenav.batch.case import Result
from safenav.batch.session import Report
from safenav.lines import printable
from safenav.report.terminal.fold import echo_folded


class ProgressLine:
    EVERY = 10.0
    """Seconds between lines if standard error is not a terminal."""

    def __init__(self) -> None:
        self._live = sys.stderr.isatty()
        self._last = 0.0

    def waiting(self, report: Report, running: Sequence[tuple[str, float]]) -> None:
        if self._live:
            self._show(_state(report, running))
        elif report.seconds - self._last >= self.EVERY:
            self._last = report.seconds
            click.echo(_state(report, running), err=True)

    def arrived(self, report: Report, result: Result) -> None:
        if not result.passed:
            self.clear()
            reason = result.reasons[0].removeprefix(f"{result.name}:") if result.reasons else ""
            verdict = click.style(result.verdict.value, fg="red")
            echo_folded([f"{verdict} {printable(f'{result.name}: {reason}')}"], err=True)
        if self._live:
            self._show(_state(report, ()))

    def clear(self) -> None:
        """Remove the line, to make room for other output."""
        if self._live:
            click.echo("\r\033[K", nl=False, err=True)

    def _show(self, text: str) -> None:
        width = shutil.get_terminal_size().columns - 1
        click.echo(f"\r\033[K{text[:width]}", nl=False, err=True)


def _state(report: Report, running: Sequence[tuple[str, float]]) -> str:
    total, done = len(report.cases), len(report.results)
    text = f"{str(done).rjust(len(str(total)))}/{total}"
    failed = sum(not result.passed for result in report.results.values())
    if failed:
        text += f", {failed} failed"
    longest = sorted(running, key=lambda case: -case[1])[:2]
    if longest:
        text += "; running " + ", ".join(f"{name} ({s:.0f} s)" for name, s in longest)
    return printable(text)
