"""Writes a trace: JSON Lines, each line flushed when it happens (docs/trace.md)."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from safenav.errors import UsageError
from safenav.lines import json_line
from safenav.trace.fields import plain
from safenav.trace.records import Header, Record

Listener = Callable[[Record], None]
"""Receives each record of a run as it happens."""


def as_data(record: Record) -> dict[str, Any]:
    """The record as one JSON object of the trace."""
    data = {"type": record.type, **plain(record)}
    if record.note:
        data["note"] = True
    if isinstance(record, Header):
        del data["tick"]
    return data


class TraceWriter:
    """A listener that appends each record to a file and flushes it. The first record replaces what
    the file held; a run that is refused before leaves it as it was.

    Raises UsageError when the file cannot be opened or written: a run whose trace is lost must
    not continue.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path = Path(path)
        self._begun = False
        self._made = not path.exists()
        try:
            self._file: IO[str] = path.open("a", encoding="utf-8")
        except OSError as error:
            raise self._failure(error) from error
        except BaseException:
            self._remove_empty()
            raise

    def __call__(self, record: Record) -> None:
        line = json_line(as_data(record))
        try:
            if not self._begun and stat.S_ISREG(os.fstat(self._file.fileno()).st_mode):
                self._made = True
                self._file.truncate(0)
            self._file.write(line)
            self._file.flush()
            self._begun = True
        except OSError as error:
            raise self._failure(error) from error

    def _remove_empty(self) -> None:
        """An interrupt before the first record leaves no empty file."""
        if self._made and not self._begun:
            self._path.unlink(missing_ok=True)

    def _failure(self, error: OSError) -> UsageError:
        return UsageError(f"cannot write the trace {self._path}: {error.strerror}")

    def __enter__(self) -> TraceWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            self._file.close()
            self._remove_empty()
        except OSError as failure:
            if kind is None:
                raise self._failure(failure) from failure
