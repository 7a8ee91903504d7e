"""Matrix files: one scenario, many runs (docs/batch.md).

    batch: 1
    scenarios: [door.yaml, rooms/*.yaml]
    matrix:
      seed: {from: 0, to: 9}
      limits.ticks: [100, 500]
    exclude:
      - {seed: 3, limits.ticks: 100}
    include:
      - {seed: 99, expect.outcome: operator_needed}

Every combination of the matrix that no ``exclude`` item matches is run, and each ``include`` item.
"""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

from msgspec import Struct

from safenav.scenario.reading.loader import ScenarioKeys
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, plain
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.source import parsed

VERSION = 1
KEYS = ("batch", "scenarios", "matrix", "exclude", "include")
MOST_COMBINATIONS = 100_000

_MARK = re.compile(r"^(batch|matrix)\s*:", re.MULTILINE)
_RANGE = re.compile(r"(\d+) ?(?:-|\.\.+|to) ?(\d+)")
_FIXED = ("safenav", "name")


class Named(Struct, frozen=True):
    """A path as written in the file, and its position."""

    value: str
    line: int
    column: int


class Matrix(Struct, frozen=True):
    """Each of ``scenarios`` (paths beside the file, folders, patterns) with each of
    ``settings``."""

    scenarios: tuple[Named, ...]
    settings: tuple[dict[str, Any], ...]


def is_matrix(text: str) -> bool:
    """Return whether a text is meant as a matrix file: a line begins with ``batch:``, or with
    ``matrix:`` if the former was forgotten."""
    return _MARK.search(text) is not None


def read_matrix(text: str, file: str) -> Matrix:
    """Read a matrix file. Raises InputError with all its errors."""
    findings = Findings(file)
    root = parsed(text, findings)
    matrix = None if root is None else _matrix(root, findings)
    findings.raise_if_any()
    assert matrix is not None
    return matrix


def _matrix(root: Node, findings: Findings) -> Matrix | None:
    required = {
        "batch": f"begin the file with 'batch: {VERSION}', the version of its format",
        "scenarios": "list the scenarios to run, as paths beside this file",
    }
    item = read.mapping(root, "the batch", findings, KEYS, required)
    if item is None:
        return None
    version = read.integer(item.get("batch"), "'batch' (the version of the format)", findings)
    if version is not None and version != VERSION:
        found = f"version {version} of the batch format is unknown"
        findings.add(item.get("batch"), found, f"this safenav reads 'batch: {VERSION}'")
    scenarios = _scenarios(item.get("scenarios"), findings)
    axes = _axes(item.get("matrix"), findings)
    excluded = _settings_list(item.get("exclude"), "exclude", findings)
    _check_excluded(item.get("exclude"), excluded, axes, findings)
    included = _settings_list(item.get("include"), "include", findings)
    combinations = math.prod(len(values) for values in axes.values())
    if combinations > MOST_COMBINATIONS:
        found = f"the matrix has {combinations} combinations"
        findings.add(item.get("matrix"), found, f"at most {MOST_COMBINATIONS} in one file")
        return None
    chosen = itertools.product(*axes.values())
    all_settings = [dict(zip(axes, values, strict=True)) for values in chosen]
    kept = [s for s in all_settings if not any(_matches(s, out) for out in excluded)]
    if item.get("matrix") is None and included:
        kept = []  # the listed runs replace the plain scenario
    runs = kept + included
    if not runs and not len(findings):
        findings.add(item.get("exclude"), "every combination is excluded")
    return Matrix(tuple(scenarios), tuple(runs))


def _scenarios(node: Node | None, findings: Findings) -> list[Named]:
    if isinstance(node, Scalar):
        node = Sequence(node.place, (node,))
    items = read.sequence(node, "'scenarios'", findings) or ()
    if node is not None and not items and not len(findings):
        findings.add(node, "'scenarios' is empty", "name at least one scenario")
    found = []
    for item in items:
        path = read.text(item, "an item of 'scenarios'", findings)
        if path is not None:
            found.append(Named(path, item.place.line, item.place.column))
    return found


def _axes(node: Node | None, findings: Findings) -> dict[str, list[Any]]:
    item = read.mapping(node, "'matrix'", findings)
    if item is None:
        return {}
    return {
        key.text: _values(values, f"'{key.text}' of matrix", findings)
        for key, values in item.entries
        if _is_path(key, findings)
    }


def _values(node: Node, what: str, findings: Findings) -> list[Any]:
    """Return the values of a list, or of ``{from: 0, to: 9}``, both included."""
    if isinstance(node, Mapping):
        required = {"from": "the first number", "to": "the last number, included"}
        item = read.mapping(node, what, findings, ("from", "to"), required)
        assert item is not None
        first = read.integer(item.get("from"), f"'from' in {what}", findings)
        last = read.integer(item.get("to"), f"'to' in {what}", findings)
        if first is None or last is None:
            return []
        if last < first or last - first >= MOST_COMBINATIONS:
            found = f"{what}: from {first} to {last} is "
            found += "empty" if last < first else f"more than {MOST_COMBINATIONS} values"
            findings.add(node, found)
            return []
        return list(range(first, last + 1))
    ends = _RANGE.fullmatch(node.text) if isinstance(node, Scalar) else None
    if ends is not None:
        hint = f"write {{from: {ends[1]}, to: {ends[2]}}}"
        read.wrong_type(node, what, "a list [...]", findings, hint)
        return []
    items = read.sequence(node, what, findings)
    if items is not None and not items:
        findings.add(node, f"{what}: a list of no values", "remove it, or give one value")
    return [plain(value) for value in items or ()]


def _settings_list(node: Node | None, what: str, findings: Findings) -> list[dict[str, Any]]:
    found = []
    for item in read.sequence(node, f"'{what}'", findings) or ():
        settings = read.mapping(item, f"an item of '{what}'", findings)
        if settings is None:
            continue
        paths = [(key.text, value) for key, value in settings.entries if _is_path(key, findings)]
        found.append({path: plain(value) for path, value in paths})
    return found


def _is_path(key: Scalar, findings: Findings) -> bool:
    """Return whether a key begins with one of a scenario's own keys; otherwise report it."""
    first = key.text.split(".")[0]
    known = [word for word in ScenarioKeys.known if word not in _FIXED]
    if first in known and all(key.text.split(".")):
        return True
    found = f"'{key.text}' is not a path into a scenario"
    findings.add(key, found, suggestion(first, known))
    return False


def _check_excluded(
    node: Node | None,
    excluded: list[dict[str, Any]],
    axes: dict[str, list[Any]],
    findings: Findings,
) -> None:
    """Report the items of ``exclude`` that can match no combination."""
    items = node.items if isinstance(node, Sequence) else ()
    for item, settings in zip(items, excluded, strict=False):
        for path, value in settings.items():
            if path not in axes:
                findings.add(item, f"'exclude': '{path}' is not in the matrix")
            elif not any(_same(value, one) for one in axes[path]):
                findings.add(item, f"'exclude': {value!r} is not a value of '{path}' in the matrix")


def _matches(settings: dict[str, Any], pattern: dict[str, Any]) -> bool:
    return all(_same(settings.get(path), value) for path, value in pattern.items())


def _same(one: Any, other: Any) -> bool:
    """Return whether two values are equal and have the same type."""
    return type(one) is type(other) and bool(one == other)
