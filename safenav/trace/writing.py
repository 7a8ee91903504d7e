"""Writes a trace: JSON Lines, each line flushed when it happens (docs/trace.md)."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from safenav.errors import UsageError
from safenav.trace.fields import plain
from safenav.trace.records import Header, Record

Listener = Callable[[Record], None]
"""Hears what happens in a run, as it happens."""


def as_data(record: Record) -> dict[str, Any]:
    """The record as one JSON object of the trace."""
    data = {"type": record.type, **plain(record)}
    if isinstance(record, Header):
        del data["tick"]
    return data


class TraceWriter:
    """A listener that appends each record to a file and flushes it.

    Raises UsageError when the file cannot be opened or written: a run whose trace is lost must
    not continue.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file: IO[str] = path.open("w", encoding="utf-8")
        except OSError as error:
            raise self._failure(error) from error

    def __call__(self, record: Record) -> None:
        try:
            self._file.write(json.dumps(as_data(record), separators=(",", ":")) + "\n")
            self._file.flush()
        except OSError as error:
            raise self._failure(error) from error

    def _failure(self, error: OSError) -> UsageError:
        return UsageError(f"cannot write the trace {self._path}: {error.strerror}")

    def __enter__(self) -> TraceWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self._file.close()
        except OSError as failure:
            if kind is None:
                raise self._failure(failure) from failure
