"""Conversion of JSON values to the data that annotations require, with diagnostics.

Knows the annotations that the records of ``safenav.trace`` use: plain types, ``X | None`` and other
unions, ``Annotated`` with a ``Meta`` of bounds, enums, tuples, frozen sets, mappings from
strings, structs (objects, or lists if they are ``array_like``), and ``Objective``.
"""

from __future__ import annotations

import json
import re
import types
from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from functools import cache
from inspect import get_annotations
from itertools import repeat
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from msgspec import NODEFAULT, Meta, Struct

from safenav.trace.objective import EXAMPLE, Objective

_SHOWN_CHARACTERS = 60
_EXACT = 2**53
_ABSENT = object()


class WrongError(Exception):
    """The errors of a value: one sentence for each field."""

    def __init__(self, *problems: tuple[str, str, object]) -> None:
        self.places = problems

    def below(self, key: str) -> WrongError:
        """The same errors, for the value that holds this one under ``key``."""
        return WrongError(
            *(
                (f"{key}.{place}" if place and place[0] != "[" else key + place, expected, found)
                for place, expected, found in self.places
            )
        )

    @property
    def sentences(self) -> list[str]:
        """One sentence per error: field, expected and found."""
        return [
            f"`{path}` is missing"
            if found is _ABSENT
            else f"`{path}` must be {expected}, not {_shown(found)}"
            for path, expected, found in self.places
        ]


def convert(annotation: Any, value: object) -> Any:
    """Convert a value to its annotation. Raises WrongError."""
    return _converter(annotation)(value)


Converter = Callable[[Any], Any]


@cache
def _converter(annotation: Any) -> Converter:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _bounded(_converter(arguments[0]), arguments[1])
    if origin in (Union, types.UnionType):
        choices = [a for a in arguments if a is not type(None)]
        return _union(choices, nullable=type(None) in arguments)
    if origin is tuple and arguments[-1] is not Ellipsis:
        kind = "numbers" if set(arguments) == {float} else "entries"
        return _fixed([_converter(a) for a in arguments], kind)
    if origin in (tuple, frozenset):
        return _listed(origin, _converter(arguments[0]))
    if origin is not None and issubclass(origin, Mapping):
        return _mapping(_converter(arguments[1]))
    if annotation is Objective:
        return _leaf(Objective.of, f"an objective such as {EXAMPLE}")
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        return _leaf(_member_of(annotation), "one of " + ", ".join(annotation))
    if _is_struct(annotation):
        return _row(annotation) if is_row(annotation) else _data(annotation)
    return _PLAIN[annotation]


def _leaf(accept: Callable[[Any], Any], expected: str) -> Converter:
    """Return a converter; ``accept`` returns None for a value that it rejects."""

    def take(value: object) -> Any:
        taken = accept(value)
        if taken is None:
            raise WrongError(("", expected, value))
        return taken

    return take


def _member_of(kind: type[StrEnum]) -> Callable[[Any], StrEnum | None]:
    members = {member.value: member for member in kind}
    return lambda value: members.get(value) if isinstance(value, str) else None


def _number(value: object) -> float | None:
    if type(value) is int and abs(value) < _EXACT:
        return float(value)
    # No run records so large a number, and its square may overflow.
    return value if isinstance(value, float) and abs(value) < _EXACT else None


_PLAIN: dict[Any, Converter] = {
    str: _leaf(lambda v: v if isinstance(v, str) else None, "a string"),
    bool: _leaf(lambda v: v if isinstance(v, bool) else None, "true or false"),
    int: _leaf(lambda v: v if type(v) is int else None, "a whole number"),
    float: _leaf(_number, "a number"),
    object: lambda value: value,
}


def _is_struct(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Struct)


def _bounded(inner: Converter, bound: Meta) -> Converter:
    def take(value: object) -> Any:
        taken = inner(value)
        if bound.pattern is not None:
            if not re.fullmatch(bound.pattern, taken):
                raise WrongError(("", bound.description or "", value))
        elif bound.ge is not None and taken < bound.ge:
            raise WrongError(("", f"{bound.ge} or more", value))
        elif bound.min_length is not None and len(taken) < bound.min_length:
            raise WrongError(("", f"{bound.min_length} or more values", value))
        return taken

    return take


def _union(annotations: list[Any], *, nullable: bool) -> Converter:
    """A value of one of the choices, or null where that is allowed. Objects are distinguished by
    their ``kind``."""
    if len(annotations) > 1 and all(map(_is_struct, annotations)):
        kinds = {a.__struct_defaults__[-1]: a for a in annotations}
        return _by_kind(kinds, nullable=nullable)
    choices = [_converter(annotation) for annotation in annotations]

    def take(value: object) -> Any:
        if nullable and value is None:
            return None
        wrongs: list[tuple[str, str, object]] = []
        for choice in choices:
            try:
                return choice(value)
            except WrongError as error:
                wrongs += error.places
        inside = [wrong for wrong in wrongs if wrong[0]]
        if inside:
            raise WrongError(*inside)
        expected = [expected for _, expected, _ in wrongs] + ["null"] * nullable
        raise WrongError(("", " or ".join(expected), value))

    return take


def _by_kind(kinds: Mapping[Any, Any], *, nullable: bool) -> Converter:
    def take(value: object) -> Any:
        kind = value.get("kind") if isinstance(value, dict) else None
        if nullable and value is None:
            return None
        if not isinstance(kind, str) or kind not in kinds:
            raise WrongError(("", "an object whose kind is one of " + ", ".join(kinds), value))
        return _converter(kinds[kind])(value)

    return take


def _listed(kind: Callable[[list[Any]], Any], item: Converter) -> Converter:
    def take(value: object) -> Any:
        if not isinstance(value, list):
            raise WrongError(("", "a list", value))
        return kind(_items(zip(repeat(item), value)))

    return take


def _fixed(items: list[Converter], kind: str) -> Converter:
    def take(value: object) -> Any:
        if not isinstance(value, list) or len(value) != len(items):
            raise WrongError(("", f"a list of {len(items)} {kind}", value))
        return tuple(_items(zip(items, value, strict=True)))

    return take


def _items(entries: Iterable[tuple[Converter, object]]) -> list[Any]:
    taken: list[Any] = []
    try:
        for item, entry in entries:
            taken.append(item(entry))
    except WrongError as error:
        raise error.below(f"[{len(taken)}]") from None
    return taken


def _row(kind: Any) -> Converter:
    hints = annotations_of(kind)
    whole = _fixed([_converter(hints[entry.name]) for entry in entries(kind)], "entries")
    return lambda value: kind(*whole(value))


def _mapping(item: Converter) -> Converter:
    def take(value: object) -> Any:
        if not isinstance(value, dict):
            raise WrongError(("", "an object", value))
        taken: dict[str, Any] = {}
        for key, entry in value.items():
            try:
                taken[key] = item(entry)
            except WrongError as error:
                raise error.below(key) from None
        return taken

    return take


class FieldEntry(Struct, frozen=True):
    """A field of a record: its name in Python and in JSON, and whether it may be absent."""

    name: str
    key: str
    optional: bool
    nothing: bool
    """Whether it is omitted when it is None."""


@cache
def entries(kind: Any) -> tuple[FieldEntry, ...]:
    """The fields of a record class, or of a class of objects in one, in order."""
    keys = dict(zip(kind.__struct_fields__, kind.__struct_encode_fields__, strict=True))
    defaults = dict(zip(reversed(keys), reversed(kind.__struct_defaults__), strict=False))
    return tuple(
        FieldEntry(
            name,
            keys[name].rstrip("_"),
            defaults.get(name, NODEFAULT) is not NODEFAULT,
            defaults.get(name, NODEFAULT) is None,
        )
        for name in dict.fromkeys(
            n for base in reversed(kind.__mro__) for n in get_annotations(base)
        )
        if name in keys and name != "line"
    )


def annotations_of(kind: Any) -> dict[str, Any]:
    """The annotations of the fields, evaluated: for readers and schemas, since it takes long."""
    return get_type_hints(kind, include_extras=True)


def is_row(kind: Any) -> bool:
    """Whether a class is written as a list of its fields, in order."""
    return _is_struct(kind) and bool(kind.__struct_config__.array_like)


def _data(kind: Any) -> Converter:
    hints = annotations_of(kind)
    known = [(entry, _converter(hints[entry.name])) for entry in entries(kind)]

    def take(value: object) -> Any:
        if not isinstance(value, dict):
            raise WrongError(("", "an object", value))
        taken: dict[str, Any] = {}
        wrong: list[tuple[str, str, object]] = []
        for entry, converter in known:
            found = value.get(entry.key, _ABSENT)
            if found is _ABSENT and entry.optional:
                continue
            if found is _ABSENT:
                wrong.append((entry.key, "", _ABSENT))
                continue
            try:
                taken[entry.name] = converter(found)
            except WrongError as error:
                wrong += error.below(entry.key).places
        if wrong:
            raise WrongError(*wrong)
        return kind(**taken)

    return take


def plain(value: Any) -> Any:
    """Return a part of a record as JSON data."""
    if isinstance(value, str | int | float | None):
        return value
    if isinstance(value, Objective):
        return value.data
    if isinstance(value, Struct):
        kind: Any = type(value)
        values = [(entry, getattr(value, entry.name)) for entry in entries(kind)]
        return {e.key: plain(item) for e, item in values if item is not None or not e.nothing}
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in (sorted(value) if isinstance(value, frozenset) else value)]


def _shown(value: object) -> str:
    try:
        text = json.dumps(value, sort_keys=True)
    except RecursionError:
        return "something too deeply nested"
    return text if len(text) <= _SHOWN_CHARACTERS else text[:_SHOWN_CHARACTERS] + "..."
