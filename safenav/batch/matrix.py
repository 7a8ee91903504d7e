"""Matrix files: one scenario, many runs (docs/batch.md).

    batch: 1
    scenarios: [door.yaml, rooms/*.yaml]
    matrix:
      seed: {from: 0, to: 9}
      limits.ticks: [100, 500]

A batch runs every combination of the values. Settings change the document tree before it is read,
so a variation is checked exactly as if it were in the file. A diagnostic about a new value points
at its place in the matrix file.
"""

import itertools
import math
import re
from collections.abc import Mapping
from typing import Any, ClassVar

from msgspec import Struct
from msgspec.structs import replace

from safenav.batch.case import Case
from safenav.scenario import language
from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Place, Scalar, Sequence, node_of, plain
from safenav.scenario.yaml.findings import Findings, parsed, suggestion, wrong_type
from safenav.scenario.yaml.keys import Item, Raw, entries, key, version
from safenav.scenario.yaml.typed import read, sequence

VERSION = 1
MOST_COMBINATIONS = 100_000

_MARK = re.compile(r"^(batch|matrix)\s*:", re.MULTILINE)
_RANGE = re.compile(r"(\d+) ?(?:-|\.\.+|to) ?(\d+)")
_FIXED = ("safenav", "name")


class Range(Item, frozen=True):
    """A range of whole numbers with both ends."""

    label: ClassVar = "in {what}"
    from_: int | None = key("", "the first number")
    to: int | None = key("", "the last number, included")


class BatchKeys(Item, frozen=True):
    """A matrix file."""

    label: ClassVar = ""
    batch: int | None = version(VERSION, "batch", "batch")
    scenarios: Scalar | tuple[Scalar, ...] | None = key(
        "",
        "list the scenarios to run: files, folders or patterns, relative to this file",
        expected="a list [...]",
    )
    matrix: dict[Scalar, Raw] | None = key()


Placed = Mapping[str, tuple[Any, Place]]
"""The values that replace present ones, with their places in the matrix file, by dotted paths into
the scenario."""


class Matrix(Struct, frozen=True):
    """The content of a matrix file. Each of ``scenarios`` (files, folders, patterns, relative to
    the file) runs with each of ``settings``."""

    scenarios: tuple[Scalar, ...]
    settings: tuple[Placed, ...]


def is_matrix(text: str) -> bool:
    """Return whether a text is intended as a matrix file: one of its lines begins with ``batch:``
    (or ``matrix:``, if the user forgot ``batch:``)."""
    return _MARK.search(text) is not None


def read_matrix(text: str, file: str) -> Matrix:
    """Return the content of a matrix file. Raises InputError with all errors."""
    findings = Findings(file)
    item: BatchKeys | None = read(
        BatchKeys, parsed(text, findings, "matrix file"), "the batch", findings
    )
    given = item and item.scenarios
    scenarios = given if isinstance(given, tuple) else (given,) if given else ()
    if item and not scenarios and not item.flawed:
        findings.add(item.at("scenarios"), "'scenarios' is empty", "name at least one scenario")
    axes = {
        path.text: _values(values, findings)
        for path, values in ((item and item.matrix) or {}).items()
        if _is_path(path, findings)
    }
    combinations = math.prod(map(len, axes.values()))
    if item and combinations > MOST_COMBINATIONS:
        found = f"the matrix has {combinations} combinations"
        findings.add(item.at("matrix"), found, f"at most {MOST_COMBINATIONS} in one file")
    findings.raise_if_any()
    settings = itertools.product(*axes.values())
    return Matrix(scenarios, tuple(dict(zip(axes, each, strict=True)) for each in settings))


def _values(value: Raw, findings: Findings) -> list[tuple[Any, Place]]:
    """Return the values of a setting, a list or ``{from: 0, to: 9}`` (with both ends), each with
    its place in the matrix file."""
    node, what = value.node, value.what
    if isinstance(node, document.Mapping):
        ends = read(Range, node, what, findings)
        if ends.from_ is None or ends.to is None:
            return []
        if not 0 <= ends.to - ends.from_ < MOST_COMBINATIONS:
            found = f"{what}: from {ends.from_} to {ends.to} is "
            found += "empty" if ends.to < ends.from_ else f"more than {MOST_COMBINATIONS} values"
            findings.add(node, found)
            return []
        whole = replace(node.place, file=findings.file)
        return [(number, whole) for number in range(ends.from_, ends.to + 1)]
    span = _RANGE.fullmatch(node.text) if isinstance(node, Scalar) else None
    if span is not None:
        hint = f"write {{from: {span[1]}, to: {span[2]}}}"
        wrong_type(node, what, "a list [...]", findings, hint)
        return []
    items = sequence(node, what, findings)
    if items is not None and not items:
        findings.add(node, f"{what}: the list is empty", "remove it, or give one value")
    return [(plain(item), replace(item.place, file=findings.file)) for item in items or ()]


def _is_path(path: Scalar, findings: Findings) -> bool:
    """Return whether a path begins with one of a scenario's keys. Report any other path."""
    first = path.text.split(".")[0]
    known = [word for word in entries(language.ScenarioKeys) if word not in _FIXED]
    if first in known and all(path.text.split(".")):
        return True
    found = f"'{path.text}' is not a path into a scenario"
    findings.add(path, found, suggestion(first, known))
    return False


def varied(root: Node, case: Case, findings: Findings) -> Node:
    """Return the tree with all settings applied. Report each path that does not exist."""
    for path, value in case.settings.items():
        new = node_of(value, case.places[path])
        root = _replaced(root, path.split("."), new, path, findings)
    return root


def _replaced(node: Node, steps: list[str], value: Node, path: str, findings: Findings) -> Node:
    """Return ``node`` with the value at ``steps`` replaced. Create missing mappings."""
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    match node:
        case Sequence(place, items) if step.isdecimal() and int(step) < len(items):
            index = int(step)
            new = _replaced(items[index], rest, value, path, findings)
            return Sequence(place, (*items[:index], new, *items[index + 1 :]))
        case document.Mapping(place, entries):
            old = node.get(step)
            below = document.Mapping(value.place, ()) if old is None else old
            new = _replaced(below, rest, value, path, findings)
            if old is None:
                return document.Mapping(place, (*entries, (Scalar(value.place, step, step), new)))
            kept = [(key, new if key.value == step else item) for key, item in entries]
            return document.Mapping(place, tuple(kept))
    found = f"'{path}' of the matrix is not in the scenario: there is no '{step}' here"
    findings.add(node, found, "a path names keys, or items of a list from 0: obstacles.0.region")
    return node
