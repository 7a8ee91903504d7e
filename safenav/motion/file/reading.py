"""Reads a motion file into typed records, and writes one as JSON Lines.

The fields of each line and their types are checked. Lines of unknown types and unknown fields are
skipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, log10
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from safenav.errors import Diagnostic, InputError
from safenav.file_kind import another_kind
from safenav.lines import json_flaw, json_line, read_file
from safenav.motion.file import records
from safenav.strict_json import read_json
from safenav.trace.fields import WrongError, convert

_DIAGNOSTIC_LIMIT = 20


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
    number = 1
    for number, line in enumerate(content.split(b"\n"), start=1):
        if not line.strip():
            continue
        try:
            data = read_json(line)
            kind = data.get("type") if isinstance(data, dict) else None
            if header is None:
                header = _header(data, kind)
            elif kind == "outcome":
                outcome = convert(records.MotionOutcome, data)
            elif isinstance(kind, str) and kind in records.TYPES and kind != "header":
                lines.append(convert(records.TYPES[kind], data))
        except ValueError as error:
            found = f"this line is not JSON: {json_flaw(error)}"
            wrong.append(Diagnostic(source, number, 1, found))
        except WrongError as error:
            wrong.append(Diagnostic(source, number, 1, str(error)))
        if header is None or len(wrong) == _DIAGNOSTIC_LIMIT:
            break
    if not wrong and header is None:
        wrong.append(Diagnostic(source, 1, 1, "the file is empty"))
    elif not wrong and outcome is None:
        found = "the file ends without its 'outcome' line: it was cut off"
        hint = "write it again: safenav export TRACE --motion FILE"
        wrong.append(Diagnostic(source, number, 1, found, hint))
    if header is None or outcome is None or wrong:
        raise InputError(wrong)
    return records.Motion(header, tuple(lines), outcome)


def _header(data: Any, kind: object) -> records.MotionHeader:
    if kind != "header" or "motion" not in data:
        raise WrongError("the first line must be the header of a motion file")
    if data["motion"] != records.VERSION:
        version = data["motion"]
        raise WrongError(f"motion version {version!r}: this safenav reads {records.VERSION}")
    header: records.MotionHeader = convert(records.MotionHeader, data)
    return header


DECIMALS = 12
"""Decimals of metres, seconds and radians: joins are exact to 1e-9."""


def text_of(motion: records.Motion) -> str:
    """The lines of the file."""
    return "".join(
        json_line({key: _rounded(value, key) for key, value in to_builtins(line).items()})
        for line in (motion.header, *motion.lines, motion.outcome)
    )


def _rounded(value: object, key: str = "") -> object:
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0  # no -0.0
    if isinstance(value, list | tuple):
        return [_curve(*item) if key == "curves" else _rounded(item) for item in value]
    if isinstance(value, dict):
        return {name: _rounded(item) for name, item in value.items()}
    return value


def _curve(seconds: float, *polynomials: Sequence[float]) -> list[object]:
    """Round with more decimals for higher powers, so that each adds the same error at the end."""
    more = log10(max(seconds, 1.0))
    return [
        _rounded(seconds),
        *(
            [round(c, DECIMALS + ceil(k * more)) + 0.0 for k, c in enumerate(p)]
            for p in polynomials
        ),
    ]
