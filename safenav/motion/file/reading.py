"""Reads a motion file into typed records: every line is checked for its fields and their types.

Lines of types that this version does not know are skipped; further fields likewise.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from math import isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from safenav.errors import Diagnostic, InputError
from safenav.motion.file.records import VERSION, Line, Motion, MotionHeader, MotionOutcome
from safenav.motion.file.writing import RENAMED, ROW, TYPES

_DIAGNOSTIC_LIMIT = 20

T = TypeVar("T")


class _WrongError(Exception):
    """A value is not what the format says; the message names the field."""


def read_motion(path: Path) -> Motion:
    """The motion in a file. Raises InputError if it cannot be read or is none."""
    try:
        content = path.read_bytes()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError([Diagnostic(str(path), 0, 0, f"cannot be read: {reason}")]) from error
    return parsed(content, str(path))


def parsed(content: bytes, source: str) -> Motion:
    """The motion in some bytes. Raises InputError with up to twenty diagnostics."""
    header: MotionHeader | None = None
    outcome: MotionOutcome | None = None
    lines: list[Line] = []
    wrong: list[Diagnostic] = []
    number = 0
    for number, line in enumerate(content.split(b"\n"), start=1):
        if not line.strip() or len(wrong) >= _DIAGNOSTIC_LIMIT:
            continue
        try:
            data = json.loads(line)
            kind = data.get("type") if isinstance(data, dict) else None
            if header is None:
                header = _header(data, kind)
            elif kind == "outcome":
                outcome = _record(MotionOutcome, data, {})
            elif isinstance(kind, str) and kind in TYPES:
                lines.append(_record(TYPES[kind], data, RENAMED))
        except (ValueError, RecursionError) as error:
            wrong.append(Diagnostic(source, number, 1, f"this line is not JSON: {error}"))
        except _WrongError as error:
            wrong.append(Diagnostic(source, number, 1, str(error)))
            if header is None:
                break
    if header is not None and outcome is None and not wrong:
        found = "the file ends without its 'outcome' line: it was cut off"
        wrong.append(Diagnostic(source, number, 1, found, "write it again: safenav motion"))
    if header is None and not wrong:
        wrong.append(Diagnostic(source, 1, 1, "the file is empty"))
    if wrong:
        raise InputError(wrong)
    assert header is not None
    assert outcome is not None
    return Motion(header, tuple(lines), outcome)


def _header(data: Any, kind: object) -> MotionHeader:
    if kind != "header" or "motion" not in data:
        raise _WrongError("the first line must be the header of a motion file")
    if data["motion"] != VERSION:
        raise _WrongError(f"motion version {data['motion']!r}: this safenav reads {VERSION}")
    return _record(MotionHeader, data, {})


def _record(kind: type[T], data: Mapping[str, Any], renamed: Mapping[str, str]) -> T:
    values = {}
    for name, read in _readers(kind):
        written = renamed.get(name, name)
        if written not in data:
            raise _WrongError(f"'{written}' is missing in this line")
        try:
            values[name] = read(data[written])
        except (TypeError, ValueError, OverflowError) as error:
            raise _WrongError(f"'{written}' is wrong: {error}") from error
    return kind(**values)


_READERS: dict[str, tuple[tuple[str, Callable[[Any], Any]], ...]] = {}
"""The readers of a record's fields by the record's name: type hints are slow to resolve."""


def _readers(kind: type[Any]) -> tuple[tuple[str, Callable[[Any], Any]], ...]:
    if kind.__name__ not in _READERS:
        hints = get_type_hints(kind)
        found = tuple((field.name, _reader(hints[field.name])) for field in fields(kind))
        _READERS[kind.__name__] = found
    return _READERS[kind.__name__]


def _reader(hint: Any) -> Callable[[Any], Any]:
    """Converter from JSON to a value of a type."""
    if hint is float:
        return _number
    if hint is int:
        return _integer
    if hint is str:
        return _text
    if isinstance(hint, UnionType):
        inner = _reader(next(arg for arg in get_args(hint) if arg is not NoneType))
        return lambda value: None if value is None else inner(value)
    origin, args = get_origin(hint), get_args(hint)
    if origin is tuple and args[-1] is Ellipsis:
        item = _reader(args[0])
        return lambda value: tuple([item(v) for v in _array(value)])
    if origin is tuple:
        items = [_reader(arg) for arg in args]
        return lambda value: tuple([r(v) for r, v in zip(items, _array(value), strict=True)])
    if origin is not None and issubclass(origin, Mapping):
        inner = _anything if args[1] is object else _reader(args[1])
        return lambda value: {key: inner(item) for key, item in _mapping(value).items()}
    assert hint in ROW, hint
    row = [read for _, read in _readers(hint)]
    return lambda value: hint(*[r(v) for r, v in zip(row, _array(value), strict=True)])


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ValueError(f"a number was expected, not {str(value)[:40]!r}")
    return float(value)


def _integer(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"a whole number was expected, not {str(value)[:40]!r}")
    return value


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"a word was expected, not {str(value)[:40]!r}")
    return value


def _array(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError(f"an array was expected, not {str(value)[:40]!r}")
    return value


def _mapping(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"an object was expected, not {str(value)[:40]!r}")
    return value


def _anything(value: object) -> object:
    return value
