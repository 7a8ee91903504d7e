"""Documents with one error each, and whether a loader and a JSON Schema agree on them; and what a
trace records of a scenario."""

import json
import re
import string
from collections.abc import Iterator
from contextlib import suppress
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import pytest
from hypothesis import strategies as st

from once import ROOT
from safenav import (
    Diagnostic,
    ExitCode,
    InputError,
    Mission,
    Scenario,
    TraceWriter,
    load_scenario,
    read_trace,
)

_WORDS = st.text(alphabet=string.ascii_letters + "ü -", min_size=1, max_size=8).filter(
    lambda word: word.strip() == word
)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | _WORDS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(_WORDS, inner, max_size=4),
    max_leaves=5,
)
"""Any value that a YAML file may hold."""

WRONG_VALUES: tuple[Any, ...] = (
    *(None, True, 0, -1, 1.5, 2**31, 2**63, "", "xyz", "1 2", [], [[]], {}, {"xyz": 1}),
)
SHAPE = re.compile(
    r"\bexpected |unknown key |the key '.*' is missing|must be (at|from|more)|unknown word"
    r"|is empty$|cannot name|is reserved|: both '|without '|always_eventually|there are no robots"
    r"|at least two robots|: one of .* is missing|version \d+ of|targets, and a patrol"
    r"|is outside the map: -"
)
"""The messages of the loader about the shape alone."""

ONLY_LOADER = re.compile(r"expected a finite number|the grid is empty|must be from .*(:|$)")
"""Messages among those on what no schema states: numbers that are not finite, rows of a text,
limits that depend on the kind of motion."""


def disagreement(data: Any, found: tuple[Diagnostic, ...], validator: Any) -> str:
    """Where loader and schema judge differently; empty if they agree."""
    errors = [
        f"{'.'.join(map(str, e.path))}: {e.message[:90]}" for e in validator.iter_errors(data)
    ]
    if errors and not found:
        return f"the schema alone refuses: {errors}"
    shape = [d.found for d in found if SHAPE.search(d.found) and not ONLY_LOADER.search(d.found)]
    return f"the loader alone refuses: {shape}" if shape and not errors else ""


def keys_of(schema: Any, found: set[str]) -> set[str]:
    """The keys that a schema knows."""
    if isinstance(schema, dict):
        if isinstance(known := schema.get("properties"), dict):
            found.update(known)
        for part in schema.values():
            keys_of(part, found)
    for part in schema if isinstance(schema, list) else ():
        keys_of(part, found)
    return found


def places(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The way to each value within a value."""
    if way:
        yield way
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*way, key))


def mistakes(data: Any, way: tuple[Any, ...], turn: int) -> Iterator[tuple[str, Any]]:
    """The data with a mistake at a place: a wrong value (by turns: all at all places are 6,000
    scenarios, a minute), the key misspelt, the key missing."""
    *holders, last = way
    wrong = WRONG_VALUES[turn % len(WRONG_VALUES)]
    for mistake in ("wrong", "misspelt", "missing"):
        copy = json.loads(json.dumps(data))
        holder = reduce(getitem, holders, copy)
        if mistake == "wrong":
            holder[last] = wrong
        elif isinstance(holder, dict):
            value = holder.pop(last)
            holder |= {"xyz": value} if mistake == "misspelt" else {}
        yield f"{'.'.join(map(str, way))}: {mistake}, {wrong!r}", copy


class BegunError(Exception):
    """The first line of a trace is written."""


def recorded(scenario: Scenario, path: Path) -> Any:
    """Return what the first line of a trace records of a scenario, from which it is read back."""

    def end(_line: object) -> None:
        raise BegunError

    with TraceWriter(path) as writer, suppress(BegunError):
        Mission(scenario, listeners=[writer, end]).start()
    assert read_trace(path).header.scenario == scenario.recorded
    return json.loads(path.read_text().splitlines()[0])["scenario"]


INVALID = sorted((ROOT / "scenarios" / "invalid").rglob("*.yaml"))
ANNOUNCEMENT = re.compile(r"^# error: (\d+):(\d+): (.*)", re.MULTILINE)


def refuse_as_announced(file: Path) -> None:
    """Check that exactly the errors are reported that the comments of a file announce."""
    announced = ANNOUNCEMENT.findall(file.read_text(encoding="utf-8"))
    with pytest.raises(InputError) as caught:
        load_scenario(file)
    found = caught.value.diagnostics
    assert [(d.line, d.column) for d in found] == [(int(m[0]), int(m[1])) for m in announced]
    for diagnostic, (_, _, words) in zip(found, announced, strict=True):
        assert re.search(words, f"{diagnostic.found} {diagnostic.hint}"), diagnostic
        assert diagnostic.file == str(file)
    assert caught.value.exit_code is ExitCode.BAD_INPUT
