"""A batch as a JUnit report for continuous integration services.

There is no official standard; the report uses the common part of the schemas of Jenkins' xUnit
plugin and Apache Ant: one ``testsuite`` per folder, one ``testcase`` per case, ``failure`` for an
unexpected result, ``error`` for a case that could not be completed, ``skipped`` for a case that was
not run. Reference: https://github.com/testmoapp/junitxml"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path, PurePath

from safenav.batch.case import Case, CaseVerdict, Result
from safenav.batch.session import Report

# Characters that XML 1.0 cannot represent, even as references.
_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(report: Report, *, when: datetime | None = None) -> str:
    """Return the report as XML. ``when``: the time of the batch, default now."""
    stamp = (when or datetime.now(UTC)).strftime("%Y-%m-%dT%H:%M:%S")
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
    notes = [
        f"requirement {name}: {one['verdict']}, robustness {one['robustness']}"
        for name, one in (result.requirements or {}).items()
    ]
    if result.makespan is not None:
        notes.append(f"makespan: {result.makespan:g} s")
    if notes:
        ET.SubElement(element, "system-out").text = _clean("\n".join(notes))


def result_lines(result: Result) -> list[str]:
    """Return a case's reasons, end, settings and files, as lines."""
    lines = list(result.reasons)
    if result.outcome is not None:
        over = result.makespan
        time = f"{result.ticks} ticks" if over is None else f"{over:g} s on the clock of the run"
        lines.append(f"it ended after {time}: {result.explanation}")
    if result.settings:
        lines.append("settings: " + ", ".join(f"{k}={v}" for k, v in result.settings.items()))
    lines += [f"see {artifact}" for artifact in result.artifacts]
    if result.detail:
        lines += ["", result.detail]
    return lines


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("?", text)
