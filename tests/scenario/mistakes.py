"""Documents with one error each, and whether a loader and a JSON Schema agree on them."""

import json
import re
from collections.abc import Iterator
from functools import reduce
from operator import getitem
from typing import Any

from safenav import Diagnostic

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
"""Of those, the messages about what no schema tells: numbers that are not finite, rows of a text,
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
