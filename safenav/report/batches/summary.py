"""The end of a batch on the terminal: failures with reasons, slow cases, changes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import click
from msgspec import to_builtins

import safenav
from safenav.batch.case import Result
from safenav.batch.results import BaselineComparison
from safenav.batch.session import Report
from safenav.lines import printable
from safenav.report.terminal.table import table
from safenav.trace.words import listed

_REASONS = 3
_SLOWEST = 10
_NAMES = 20
_LEAST_NAME = 16
"""Least characters of a name on a narrow terminal."""
_STILL_OPEN = "; still open: "


def summary(
    report: Report,
    comparison: BaselineComparison | None = None,
    width: int | None = None,
) -> list[str]:
    """Return lines: a table with the failed cases first, then the slowest that passed; the
    reasons; the comparison; the totals. ``width``: of the terminal, for the table."""
    failed = report.failed
    passed = [result for result in report.in_order if result.passed]
    passed.sort(key=lambda result: -result.duration)
    shown = [*failed, *passed[:_SLOWEST]]
    lines = []
    if shown:
        live = any(result.makespan is not None for result in shown)
        times = ("ticks", "makespan") if live else ("ticks",)
        headings = ("case", "verdict", "outcome", *times, "syntheses", "seconds")
        rows = _fitted(headings, [_row(result, live) for result in shown], width)
        lines += _coloured([printable(row) for row in rows], len(failed))
        more = len(passed) - _SLOWEST
        if more > 0:
            lines.append(f"... and {more} more passed")
    for group in _by_cause(failed):
        lines += ["", *_why(group)]
    undone = [result for result in passed if _STILL_OPEN in (result.explanation or "")]
    lines += [""] if undone else []
    for result in undone[:_NAMES]:
        left = (result.explanation or "").partition(_STILL_OPEN)[2]
        lines.append(printable(f"{result.name}: passed with orders that are still open: {left}"))
    if len(undone) > _NAMES:
        lines.append(f"... and {len(undone) - _NAMES} more with such orders")
    if comparison is not None:
        lines += ["", *map(printable, _compared(comparison))]
    return [*lines, "", _sum(report)]


def _fitted(
    headings: tuple[str, ...], rows: list[tuple[object, ...]], width: int | None
) -> list[str]:
    """Return the table; if it is too wide, long names lack their middle."""
    lines = table(headings, rows)
    wide = len(lines[1])  # the rule under the headings
    if width is None or wide <= width:
        return lines
    room = max(_LEAST_NAME, max(len(str(name)) for name, *_ in rows) - (wide - width))
    return table(headings, [(_elided(str(name), room), *rest) for name, *rest in rows])


def _elided(name: str, room: int) -> str:
    if len(name) <= room:
        return name
    tail = (room - 3) // 2
    return f"{name[: room - 3 - tail]}...{name[-tail:]}"


def _row(result: Result, live: bool) -> tuple[object, ...]:
    """Return the row of a result. ``live``: with a column for the makespan."""
    seconds = f"{result.duration:.2f}".rjust(len("seconds"))
    outcome = result.outcome or "-"
    over = "-" if result.makespan is None else f"{result.makespan:.1f}"
    times = (result.ticks, over.rjust(len("makespan"))) if live else (result.ticks,)
    return result.name, result.verdict.value, outcome, *times, result.syntheses, seconds


def _coloured(lines: list[str], failed: int) -> list[str]:
    head, rows = lines[:2], lines[2:]
    return [*head, *(click.style(row, fg="red") for row in rows[:failed]), *rows[failed:]]


def _by_cause(failed: Sequence[Result]) -> list[list[Result]]:
    """Return groups of failures with the same cause, in the order of their first failures."""
    groups: dict[tuple[object, ...], list[Result]] = {}
    for result in failed:
        cause = (result.file, result.verdict, result.outcome, result.explanation)
        groups.setdefault((*cause, *result.reasons), []).append(result)
    return list(groups.values())


def _why(group: Sequence[Result]) -> list[str]:
    """Return the failure of a group of cases with the same cause, as lines."""
    result, *others = group
    lines = [f"{result.name}: {result.verdict.value}"]
    if others:
        names = (other.name.removeprefix(result.file).strip() for other in others[:_NAMES])
        lines.append(f"  likewise: {listed(names)}")
        if len(others) > _NAMES:
            lines.append(f"  ... and {len(others) - _NAMES} more")
    lines += [f"  {reason}" for reason in result.reasons[:_REASONS]]
    if len(result.reasons) > _REASONS:
        lines.append(f"  ... and {len(result.reasons) - _REASONS} more")
    if result.outcome not in (None, "completed"):
        lines.append(f"  {result.explanation}")
    lines += [f"  {artifact}" for artifact in result.artifacts]
    head, *rest = map(printable, lines)
    return [click.style(head, bold=True), *rest]


def _compared(comparison: BaselineComparison) -> list[str]:
    lines = []
    for name, differences in comparison.changed.items():
        lines += [f"changed: {name}", *(f"  {what}" for what in differences)]
    for name, (before, now) in comparison.slower.items():
        lines.append(f"slower: {name}: {before:.2f} s before, {now:.2f} s now")
    for word, names in (("new", comparison.new), ("gone", comparison.gone)):
        lines += [f"{word}: {name}" for name in names[:_NAMES]]
        if len(names) > _NAMES:
            lines.append(f"{word}: ... and {len(names) - _NAMES} more")
    return lines or ["no change and no slowdown against the baseline"]


def counts(report: Report) -> dict[str, int]:
    """Return the number of cases by verdict; zeros are omitted, except that of ``passed``."""
    found = {"passed": 0, **Counter(result.verdict.value for result in report.in_order)}
    return found | ({"not_run": report.left} if report.left else {})


def report_data(report: Report, comparison: BaselineComparison | None = None) -> dict[str, Any]:
    """Return all results of the batch as JSON data."""
    data: dict[str, Any] = {
        "safenav": safenav.__version__,
        "as_expected": report.as_expected,
        "interrupted": report.interrupted,
        "seconds": round(report.seconds, 3),
        "resumed": report.resumed,
        "counts": counts(report),
        "results": to_builtins(report.in_order),
        "not_run": [case.name for case in report.not_run],
    }
    return data if comparison is None else data | {"baseline": to_builtins(comparison)}


def _sum(report: Report) -> str:
    parts = [f"{count} {word.replace('_', ' ')}" for word, count in counts(report).items()]
    text = f"{', '.join(parts)} in {report.seconds:.1f} s"
    if report.resumed:
        text += f" ({report.resumed} of them done before)"
    text = click.style(text, fg="green" if report.as_expected else "red", bold=True)
    if report.interrupted:
        text += "; interrupted"
    elif report.stopped_early:
        text += "; stopped at the first failure"
    return text
