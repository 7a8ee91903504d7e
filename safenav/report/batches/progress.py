"""Progress of a batch on standard error, and failures when they happen."""

from __future__ import annotations

from collections.abc import Sequence

import click

from safenav.batch.case import Result
from safenav.batch.session import Report
from safenav.lines import printable
from safenav.report.terminal.fold import echo_folded
from safenav.report.terminal.progress import StatusLine


class ProgressLine(StatusLine):
    def waiting(self, report: Report, running: Sequence[tuple[str, float]]) -> None:
        self.show(_state(report, running), report.seconds)

    def arrived(self, report: Report, result: Result) -> None:
        if not result.passed:
            self.clear()
            reason = result.reasons[0].removeprefix(f"{result.name}:") if result.reasons else ""
            verdict = click.style(result.verdict.value, fg="red")
            echo_folded([f"{verdict} {printable(f'{result.name}: {reason}')}"], err=True)
        if self.live:
            self.show(_state(report, ()), report.seconds)


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
