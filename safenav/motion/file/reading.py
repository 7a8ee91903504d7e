"""Reads a motion file into typed records, and writes one as JSON Lines.

The fields of each line and their types are checked. Lines of unknown types and unknown fields are
skipped.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, log10
from pathlib import Path
from typing import Any

from msgspec import Struct

from safenav.errors import Diagnostic, InputError
from safenav.file_kind import another_kind
from safenav.lines import json_flaw, json_line, read_file
from safenav.motion.file import records
from safenav.strict_json import read_json
from safenav.trace.fields import WrongError, convert, entries

_DIAGNOSTIC_LIMIT = 20


class _HeaderError(Exception):
    """The first line is not a header that can be read."""


def read_motion(path: Path) -> records.Motion:
    """The motion in a file. Raises InputError if it cannot be read or is not a motion."""
    try:
        content = read_file(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError([Diagnostic(str(path), 0, 0, f"cannot be read: {reason}")]) from error
    if wrong := another_kind(content[:4000].decode("utf-8", "replace"), "motion file", str(path)):
        raise InputError([Diagnostic(str(path), 0, 0, *wrong)])
    return parsed(content, str(path))


def parsed(content: bytes, source: str) -> records.Motion:
    """The motion in some bytes. Raises InputError with up to twenty diagnostics."""
    header: records.MotionHeader | None = None
    outcome: records.MotionOutcome | None = None
    lines: list[records.Line] = []
    wrong: list[Diagnostic] = []
    number = 0
    for number, line in enumerate(content.split(b"\n"), start=1):
        if not line.strip() or len(wrong) >= _DIAGNOSTIC_LIMIT:
            continue
        try:
            data = read_json(line)
            kind = data.get("type") if isinstance(data, dict) else None
            if header is None:
                header = _header(data, kind)
            elif kind == "outcome":
                outcome = convert(records.MotionOutcome, data)
            elif isinstance(kind, str) and kind in records.TYPES:
                lines.append(convert(records.TYPES[kind], data))
        except ValueError as error:
            wrong.append(
                Diagnostic(source, number, 1, f"this line is not JSON: {json_flaw(error)}")
            )
        except WrongError as error:
            wrong.append(Diagnostic(source, number, 1, str(error)))
        except _HeaderError as error:
            wrong.append(Diagnostic(source, number, 1, str(error)))
        if header is None:
            break
    if header is not None and outcome is None and not wrong:
        found = "the file ends without its 'outcome' line: it was cut off"
        hint = "write it again: safenav export TRACE --motion FILE"
        wrong.append(Diagnostic(source, number, 1, found, hint))
    if header is None and not wrong:
        wrong.append(Diagnostic(source, 1, 1, "the file is empty"))
    if wrong:
        raise InputError(wrong)
    assert header is not None
    assert outcome is not None
    return records.Motion(header, tuple(lines), outcome)


def _header(data: Any, kind: object) -> records.MotionHeader:
    if kind != "header" or "motion" not in data:
        raise _HeaderError("the first line must be the header of a motion file")
    if data["motion"] != records.VERSION:
        raise _HeaderError(
            f"motion version {data['motion']!r}: this safenav reads {records.VERSION}"
        )
    header: records.MotionHeader = convert(records.MotionHeader, data)
    return header


NAMES = {kind: name for name, kind in records.TYPES.items()}

DECIMALS = 12
"""Decimals of metres, seconds and radians: joins are exact to 1e-9."""


def text_of(motion: records.Motion) -> str:
    """The lines of the file."""
    header = motion.header
    lines: list[dict[str, object]] = [
        {"type": "header", "motion": records.VERSION, **_object(header)}
    ]
    lines += [{"type": NAMES[type(line)], **_object(line)} for line in motion.lines]
    lines.append({"type": "outcome", **_object(motion.outcome)})
    return "".join(map(json_line, lines))


def _object(record: object) -> dict[str, object]:
    kind: Any = type(record)
    return {entry.key: _plain(getattr(record, entry.name)) for entry in entries(kind)}


def _plain(value: object) -> object:
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0  # no -0.0
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    kind: Any = type(value)
    if not isinstance(value, Struct):
        return value
    fields = [getattr(value, entry.name) for entry in entries(kind)]
    if isinstance(value, records.Curve):
        known = value.seconds
        return [_polynomial(f, known) if isinstance(f, tuple) else _plain(f) for f in fields]
    return list(map(_plain, fields))


def _polynomial(coefficients: records.Numbers, seconds: float) -> list[float]:
    """Round with more decimals for higher powers, so that each adds the same error at the end."""
    more = log10(max(seconds, 1.0))
    return [round(c, DECIMALS + ceil(k * more)) + 0.0 for k, c in enumerate(coefficients)]
