"""JSON lines, CSV, and line ends of text: a line feed, perhaps after a carriage return.

Python, YAML and some editors also end lines at other characters (U+0085, U+2028, a single carriage
return). In a text with one of them, ``# a comment<U+2028>a formula`` is a comment to one program
and a formula to another. Such texts are refused.
"""

from __future__ import annotations

import errno
import io
import json
import os
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

_FOREIGN = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029]|\r(?!\n|\Z)")

HINT = "remove it: programs disagree on what it means, for example on whether a line ends there"


MOST_BYTES = 100_000_000
"""Largest file of foreign data that is read."""
MOST_VALUES = 6_000_000
"""Most values in it, counted by their brackets and commas: each takes up to 80 bytes."""


def read_file(path: str | Path | None, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file, or of standard input. Raises OSError, also if it is larger than
    ``most`` (a device may have no end) or has more than ``MOST_VALUES`` values."""
    if path is None:
        data = sys.stdin.buffer.read(most + 1)
    else:
        with Path(path).open("rb") as file:
            data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it is larger than {most // 1_000_000} MB", str(path or "-"))
    if sum(map(data.count, (b"[", b"{", b","))) > MOST_VALUES:
        flaw = f"it has more than {MOST_VALUES // 1_000_000} million values"
        raise OSError(errno.EFBIG, flaw, str(path or "-"))
    return data


def printable(text: str) -> str:
    """Return the text of a file or of its name without characters that control the terminal."""
    return "".join(char if char.isprintable() or char == "\n" else "?" for char in text)


def json_line(data: Any) -> str:
    """Return data as a line of JSON, compact and in ASCII."""
    return json.dumps(data, separators=(",", ":")) + "\n"


def line_output() -> Callable[[Any], None]:
    """Return a writer of JSON lines, for any thread, to the present standard output; all other
    output then goes to standard error."""
    from threading import Lock  # only needed in child processes

    out, lock = os.fdopen(os.dup(1), "w", encoding="utf-8"), Lock()
    os.dup2(2, 1)

    def write(data: Any) -> None:
        with lock:
            out.write(json_line(data))
            out.flush()

    return write


def json_flaw(error: Exception) -> str:
    """Return the reason why a text is not JSON, and the position."""
    if isinstance(error, json.JSONDecodeError):
        line = f"line {error.lineno}, " if error.lineno > 1 else ""
        return f"{error.msg} at {line}column {error.colno}"
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is not UTF-8"
    return "too deeply nested" if isinstance(error, RecursionError) else str(error)


def csv_text(headings: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Return a table as CSV (RFC 4180, with line feeds): the headings, then the rows; None is an
    empty field."""
    import csv  # only needed here

    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([headings, *rows])
    return text.getvalue()


def foreign_character(text: str) -> tuple[int, int, str] | None:
    """Return line and column (from 1) and name of the first character that programs interpret
    differently; None if there is none."""
    match = _FOREIGN.search(text)
    if match is None:
        return None
    before = text[: match.start()]
    column = match.start() - before.rfind("\n")
    return before.count("\n") + 1, column, f"the character U+{ord(match.group()):04X}"
