"""A batch as a file: JSON (which ``--baseline`` reads again) and CSV, a line for each case."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from msgspec import convert, to_builtins

import safenav
from safenav.batch.baseline import BaselineComparison
from safenav.batch.cases.case import CaseVerdict, Result
from safenav.batch.session import Report
from safenav.errors import UsageError
from safenav.lines import csv_text, json_flaw, read_file
from safenav.strict_json import read_json

VERSION = 1

COLUMNS = (
    "name",
    "file",
    "settings",
    "verdict",
    "reasons",
    "outcome",
    "cause",
    "ticks",
    "makespan",
    "syntheses",
    "synthesis_seconds",
    "seconds",
    "wall_seconds",
    "attempts",
)


def counts(report: Report) -> dict[str, int]:
    """Return the number of cases by verdict; zeros are omitted, except that of ``passed``."""
    found = {CaseVerdict.PASSED.value: 0}
    for result in report.in_order:
        found[result.verdict.value] = found.get(result.verdict.value, 0) + 1
    if report.left:
        found["not_run"] = report.left
    return found


def to_json(report: Report, comparison: BaselineComparison | None = None) -> str:
    """Return all results of the batch as JSON."""
    data: dict[str, Any] = {
        "batch": VERSION,
        "safenav": safenav.__version__,
        "as_expected": report.as_expected,
        "interrupted": report.interrupted,
        "seconds": round(report.seconds, 3),
        "resumed": report.resumed,
        "counts": counts(report),
        "results": [result.record() for result in report.in_order],
        "not_run": [case.name for case in report.not_run],
    }
    if comparison is not None:
        data["baseline"] = to_builtins(comparison)
    return json.dumps(data, indent=2) + "\n"


def to_csv(report: Report) -> str:
    """Return the figures of each case as CSV, with the least robustness of each requirement."""
    required = list(dict.fromkeys(n for r in report.in_order for n in r.requirements or ()))
    rows = []
    for result in report.in_order:
        record = result.record()
        record["settings"] = json.dumps(result.settings)
        record["reasons"] = "; ".join(result.reasons)
        judged = result.requirements or {}
        least = [judged[name]["robustness"][0] if name in judged else None for name in required]
        rows.append([*(record[column] for column in COLUMNS), *least])
    return csv_text([*COLUMNS, *(f"requirement {name}" for name in required)], rows)


def read_results(path: Path) -> dict[str, Result]:
    """Return the results in a file of an earlier ``--results``, by name. Raises UsageError for any
    other file."""
    try:
        data = read_json(read_file(path))
    except OSError as error:
        raise UsageError(f"cannot read the baseline {path}: {error.strerror}") from error
    except ValueError as error:
        raise _no_results(path, f"it is not JSON: {json_flaw(error)}") from error
    if not isinstance(data, dict) or data.get("batch") != VERSION:
        raise _no_results(path, f"it does not begin with 'batch': {VERSION}")
    try:
        results = convert(data["results"], list[Result])
    except (KeyError, ValueError) as error:
        raise _no_results(path, f"{type(error).__name__}: {error}") from error
    return {result.name: result for result in results}


def _no_results(path: Path, why: str) -> UsageError:
    return UsageError(
        f"{path} is not a result of a batch ({why})\n    a baseline is written by --results"
    )
