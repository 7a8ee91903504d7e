"""Taking typed fields out of one JSON object, and saying what is wrong with it.

A field that cannot be used is reported and stands in for itself with a harmless value; the
caller looks at ``problems`` before it uses anything.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from enum import StrEnum
from typing import TypeGuard, TypeVar

from safenav.audit.records import Heading, Objective, Region

E = TypeVar("E", bound=StrEnum)
T = TypeVar("T")

HEADINGS = ("north", "east", "south", "west")
_MISSING = object()
_NOTHING = Objective("", (), "")
_SHOWN_CHARACTERS = 60


class Fields:
    """The fields of one object. ``where`` names the object in messages (empty: the line)."""

    def __init__(self, data: Mapping[str, object], problems: list[str], where: str = "") -> None:
        self._data = data
        self._where = where
        self.problems = problems

    def text(self, key: str) -> str:
        value = self._get(key)
        return value if isinstance(value, str) else self._wrong(key, "a string", "")

    def text_or_null(self, key: str) -> str | None:
        value = self._get(key)
        if value is None or isinstance(value, str):
            return value
        return self._wrong(key, "a string or null", None)

    def integer(self, key: str) -> int:
        value = self._get(key)
        return value if _is_int(value) else self._wrong(key, "a whole number", 0)

    def integer_or_null(self, key: str) -> int | None:
        value = self._get(key)
        if value is None or _is_int(value):
            return value
        return self._wrong(key, "a whole number or null", None)

    def count(self, key: str) -> int:
        value = self.integer(key)
        return value if value >= 0 else self._wrong(key, "zero or more", 0)

    def number(self, key: str) -> float:
        value = self._get(key)
        if _is_int(value):
            return float(value) if abs(value) < 2**53 else self._wrong(key, "a number", 0.0)
        if isinstance(value, float) and math.isfinite(value):
            return value
        return self._wrong(key, "a number", 0.0)

    def number_or_null(self, key: str) -> float | None:
        return None if self._get(key) is None else self.number(key)

    def flag(self, key: str) -> bool:
        value = self._get(key)
        return value if isinstance(value, bool) else self._wrong(key, "true or false", False)

    def flag_or_null(self, key: str) -> bool | None:
        value = self._get(key)
        if value is None or isinstance(value, bool):
            return value
        return self._wrong(key, "true, false or null", None)

    def one_of(self, key: str, kind: type[E]) -> E:
        value = self._get(key)
        known = list(kind)
        if isinstance(value, str) and value in known:
            return kind(value)
        return self._wrong(key, "one of " + ", ".join(known), known[0])

    def heading_or_null(self, key: str) -> Heading | None:
        value = self._get(key)
        if value is None or (isinstance(value, str) and value in HEADINGS):
            return value
        return self._wrong(key, "north, east, south, west or null", None)

    def regions(self, key: str) -> tuple[Region, ...]:
        value = self._get(key)
        if isinstance(value, list) and all(_is_int(item) for item in value):
            return tuple(value)
        return self._wrong(key, "a list of regions", ())

    def texts(self, key: str) -> tuple[str, ...]:
        value = self._get(key)
        if isinstance(value, list) and all(isinstance(item, str) for item in value):
            return tuple(value)
        return self._wrong(key, "a list of strings", ())

    def counts(self, key: str) -> dict[str, int]:
        value = self._get(key)
        if isinstance(value, dict) and all(_is_int(n) and n >= 0 for n in value.values()):
            return dict(value)
        return self._wrong(key, "an object with whole numbers", {})

    def numbers(self, key: str, count: int) -> tuple[float, ...]:
        """So many numbers."""
        value = self._get(key)
        if isinstance(value, list) and len(value) == count:
            problems: list[str] = []
            items = Fields({str(i): item for i, item in enumerate(value)}, problems)
            numbers = tuple(items.number(str(i)) for i in range(count))
            if not problems:
                return numbers
        return self._wrong(key, f"a list of {count} numbers", (0.0,) * count)

    def distances(self, key: str) -> dict[str, int | None]:
        value = self._get(key)
        if isinstance(value, dict) and all(
            n is None or (_is_int(n) and n >= 0) for n in value.values()
        ):
            return dict(value)
        return self._wrong(key, "an object with whole numbers or null", {})

    def objective(self, key: str) -> Objective:
        value = self._get(key)
        found = parse_objective(value)
        return found or self._wrong(key, "an objective such as {'visit': [3, 5]}", _NOTHING)

    def objectives(self, key: str) -> dict[str, Objective]:
        inner = self.inner(key)
        return {name: inner.objective(name) for name in self._object(key)}

    def inner(self, key: str) -> Fields:
        """The object in a field."""
        return Fields(self._object(key), self.problems, self._path(key))

    def inner_each(self, key: str) -> dict[str, Fields]:
        """The objects in an object, by name, in order."""
        found = {}
        for name, value in self._object(key).items():
            path = f"{self._path(key)}.{name}"
            if isinstance(value, dict):
                found[name] = Fields(value, self.problems, path)
            else:
                self.problems.append(f"`{path}` must be an object")
        return found

    def inner_list(self, key: str) -> list[Fields]:
        """The objects in a list, in order."""
        value = self._get(key)
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            return self._wrong(key, "a list of objects", [])
        return [
            Fields(item, self.problems, f"{self._path(key)}[{i}]") for i, item in enumerate(value)
        ]

    def has(self, key: str) -> bool:
        return key in self._data

    def object_or_null(self, key: str) -> dict[str, object] | None:
        return None if self._get(key) is None else self._object(key)

    def _object(self, key: str) -> dict[str, object]:
        value = self._get(key)
        return value if isinstance(value, dict) else self._wrong(key, "an object", {})

    def _path(self, key: str) -> str:
        return f"{self._where}.{key}" if self._where else key

    def _get(self, key: str) -> object:
        return self._data.get(key, _MISSING)

    def _wrong(self, key: str, expected: str, stand_in: T) -> T:
        if key in self._data:
            self._report(f"`{self._path(key)}` must be {expected}, not {_shown(self._data[key])}")
        else:
            self._report(f"`{self._path(key)}` is missing")
        return stand_in

    def _report(self, problem: str) -> None:
        if problem not in self.problems:
            self.problems.append(problem)


def parse_objective(value: object) -> Objective | None:
    """An objective as a trace spells it; None if it is none.

    Kinds that this version does not know, and ``ltl``, have no targets.
    """
    if not isinstance(value, dict) or len(value) != 1:
        return None
    ((kind, body),) = value.items()
    targets: list[frozenset[Region]] = []
    if kind in ("patrol", "visit", "cover", "hold"):
        listed = [body] if kind == "hold" else body
        if not isinstance(listed, list) or not listed or (kind == "patrol" and len(listed) != 2):
            return None
        for item in listed:
            regions = item if isinstance(item, list) else [item]
            if not regions or not all(_is_int(region) for region in regions):
                return None
            targets.append(frozenset(regions))
        shown = ", ".join("|".join(map(str, sorted(target))) for target in targets)
    else:
        shown = _spelled(body)
    return Objective(kind, tuple(targets), f"{kind} {shown}")


def _is_int(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _spelled(value: object) -> str:
    try:
        return json.dumps(value, sort_keys=True)
    except RecursionError:
        return "something too deeply nested"


def _shown(value: object) -> str:
    text = _spelled(value)
    return text if len(text) <= _SHOWN_CHARACTERS else text[:_SHOWN_CHARACTERS] + "..."
