"""Results of a batch on the terminal: failures with their reasons, and slow cases."""

import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path, PurePath
from typing import Any

import click
from msgspec import to_builtins
from msgspec.structs import replace

import safenav
from safenav.batch.case import Case, CaseVerdict, Result, file_name
from safenav.batch.session import Report
from safenav.errors import UsageError
from safenav.files import printable
from safenav.report.terminal.layout import StatusLine, echo_lines, table
from safenav.trace.words import counted, listed

_SLOWEST = 10
_NAMES = 20


def summary(report: Report) -> list[str]:
    """Return a report as lines: a table of the failed cases and the slowest passed ones; the
    reasons of the failures; the totals."""
    failed = report.failed
    passed = [result for result in report.in_order if result.passed]
    passed.sort(key=lambda result: -result.duration)
    shown = [*failed, *passed[:_SLOWEST]]
    lines = []
    if shown:
        headings = ("case", "verdict", "outcome", "time", "syntheses", "seconds")
        rows = table(headings, [*map(_row, shown)])
        lines += _coloured([printable(row) for row in rows], len(failed))
        more = len(passed) - _SLOWEST
        if more > 0:
            lines.append(f"... and {more} more passed")
    for group in _by_cause(failed):
        lines += ["", *_why(group)]
    return [*lines, "", _sum(report)]


def _row(result: Result) -> tuple[object, ...]:
    seconds = f"{result.duration:.2f}".rjust(len("seconds"))
    time = None if result.ticks is None else counted(result.ticks, "tick")
    if result.makespan is not None:
        time = f"{result.makespan:.1f} s"
    return result.name, result.verdict.value, result.outcome, time, result.syntheses, seconds


def _coloured(lines: list[str], failed: int) -> list[str]:
    head, rows = lines[:2], lines[2:]
    return [*head, *(click.style(row, fg="red") for row in rows[:failed]), *rows[failed:]]


def _by_cause(failed: Sequence[Result]) -> list[list[Result]]:
    """Return the failed results in groups by cause, in the order of first failures."""
    groups: dict[tuple[object, ...], list[Result]] = {}
    for result in failed:
        cause = (result.file, result.verdict, result.outcome, result.explanation)
        groups.setdefault((*cause, *result.reasons), []).append(result)
    return list(groups.values())


def _why(group: Sequence[Result]) -> list[str]:
    """Return the description of failures with the same cause as lines."""
    result, *others = group
    head = [f"{result.name}: {result.verdict.value}"]
    if others:
        names = (other.name.removeprefix(result.file).strip() for other in others[:_NAMES])
        more = f" and {len(others) - _NAMES} more" if len(others) > _NAMES else ""
        head.append(f"  likewise: {listed(names)}{more}")
    reasons = (f"  {line}" for line in result_lines(replace(result, detail="", settings={})))
    first, *rest = map(printable, (*head, *reasons))
    return [click.style(first, bold=True), *rest]


def counts(report: Report) -> dict[str, int]:
    """Return the number of cases by verdict, without zeros except for ``passed``."""
    found = {"passed": 0, **Counter(result.verdict.value for result in report.in_order)}
    return found | ({"not_run": report.left} if report.left else {})


def report_data(report: Report) -> dict[str, Any]:
    """Return all results of the batch as JSON data."""
    return {
        "safenav": safenav.__version__,
        "as_expected": report.as_expected,
        "interrupted": report.interrupted,
        "seconds": round(report.seconds, 3),
        "resumed": report.resumed,
        "counts": counts(report),
        "results": to_builtins(report.in_order),
        "not_run": [case.name for case in report.not_run],
    }


def _sum(report: Report) -> str:
    parts = [f"{count} {word.replace('_', ' ')}" for word, count in counts(report).items()]
    text = f"{', '.join(parts)} in {report.seconds:.1f} s"
    if report.resumed:
        text += f" ({report.resumed} of them from earlier runs)"
    text = click.style(text, fg="green" if report.as_expected else "red", bold=True)
    if report.interrupted:
        text += "; interrupted"
    return text


# Characters that XML 1.0 cannot represent, even as references.
_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(report: Report) -> str:
    """Return the report as XML."""
    stamp = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
    root = ET.Element("testsuites", name="safenav batch")
    suites: dict[str, list[Case]] = {}
    for case in report.cases:
        suites.setdefault(PurePath(case.file).parent.as_posix(), []).append(case)
    for folder, cases in suites.items():
        results = [report.results[case.name] for case in cases if case.name in report.results]
        here = _clean(Path(folder).resolve().name if folder == "." else folder)
        suite = ET.SubElement(root, "testsuite", name=here, timestamp=stamp)
        _count(suite, results, len(cases))
        for case in cases:
            _testcase(suite, here, case, report.results.get(case.name))
    _count(root, report.in_order, len(report.cases))
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _count(element: ET.Element, results: Iterable[Result], cases: int) -> None:
    done = list(results)
    failures = sum(result.verdict is CaseVerdict.DIFFERENT for result in done)
    errors = sum(not result.passed for result in done) - failures
    element.set("tests", str(cases))
    element.set("failures", str(failures))
    element.set("errors", str(errors))
    if element.tag == "testsuite":
        element.set("skipped", str(cases - len(done)))
    element.set("time", f"{sum(result.wall_seconds for result in done):.3f}")


def _testcase(suite: ET.Element, folder: str, case: Case, result: Result | None) -> None:
    name = case.name.removeprefix(f"{folder}/")
    element = ET.SubElement(suite, "testcase", name=_clean(name), classname=folder)
    if result is None:
        element.set("time", "0.000")
        ET.SubElement(element, "skipped", message="not run: the batch was stopped before")
        return
    element.set("time", f"{result.wall_seconds:.3f}")
    if not result.passed:
        word = "failure" if result.verdict is CaseVerdict.DIFFERENT else "error"
        message = _clean("; ".join(result.reasons))
        child = ET.SubElement(element, word, message=message, type=result.verdict.value)
        child.text = _clean("\n".join(result_lines(result)))


def result_lines(result: Result) -> list[str]:
    """Return a case's reasons, the end of its run, its settings and its files as lines."""
    lines = list(result.reasons)
    if result.outcome is not None:
        over = result.makespan
        ticks = counted(result.ticks or 0, "tick")
        time = ticks if over is None else f"{over:g} s on the clock of the run"
        lines.append(f"the run ended after {time}: {result.explanation}")
    if result.settings:
        lines.append("settings: " + ", ".join(f"{k}={v}" for k, v in result.settings.items()))
    lines += [f"see {artifact}" for artifact in result.artifacts]
    if result.detail:
        lines += ["", result.detail]
    return lines


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("?", text)


FOLDER = "failures"


class FailureFolder:
    """The traces of failed cases in ``directory/failures``. Traces of a former batch are removed
    unless they belong to ``kept`` results."""

    def __init__(self, directory: Path, kept: Iterable[Result]) -> None:
        self._root = directory / FOLDER
        still = {self._file(result) for result in kept if not result.passed}
        for file in {*self._root.glob("*.jsonl")} - still:
            file.unlink()

    def _file(self, result: Result) -> Path:
        return self._root / f"{file_name(result.name, result.fingerprint)}.jsonl"

    def __call__(self, result: Result, trace: bytes) -> list[str]:
        file = self._file(result)
        if not trace:
            return []
        try:
            self._root.mkdir(parents=True, exist_ok=True)
            file.write_bytes(trace)
        except OSError as error:
            raise UsageError(f"cannot write {file}: {error.strerror}") from error
        return [str(file)]


class ProgressLine(StatusLine):
    """The status line of a batch. It prints each failure on arrival."""

    def __call__(self, report: Report, arrived: Result | None) -> None:
        if arrived is None:
            self.show(_state(report), report.seconds)
        elif not arrived.passed:
            self.clear()
            reason = "".join(arrived.reasons[:1]).removeprefix(f"{arrived.name}:").strip()
            verdict = click.style(arrived.verdict.value, fg="red")
            echo_lines([f"{verdict} {printable(f'{arrived.name}: {reason}')}"], err=True)


def _state(report: Report) -> str:
    total, done = len(report.cases), len(report.results)
    text = f"{str(done).rjust(len(str(total)))}/{total}"
    failed = sum(not result.passed for result in report.results.values())
    if failed:
        text += f", {failed} failed"
    longest = sorted(report.running, key=lambda case: -case[1])[:2]
    if longest:
        text += "; running " + ", ".join(f"{name} ({s:.0f} s)" for name, s in longest)
    return printable(text)
