"""The trace that a motion is made of: its records, and the sum by which it is known again."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from msgspec import Struct

from safenav.errors import Diagnostic, InputError
from safenav.trace.reading import read_bytes
from safenav.trace.trace import Trace


class Source(Struct, frozen=True):
    """A trace and the sha256 of its file."""

    trace: Trace
    digest: str


def read_source(path: Path) -> Source:
    """The trace in a file. Raises InputError if it cannot be read or is none."""
    try:
        content = path.read_bytes()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError([Diagnostic(str(path), 0, 0, f"cannot be read: {reason}")]) from error
    return Source(read_bytes(content, str(path)), sha256(content).hexdigest())
