"""Writing what was made for the user: whole files or none."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import click

from safenav.errors import UsageError


def write_bytes(path: Path, content: bytes) -> None:
    """The content under that name (``-``: standard output), and a word about it.

    Raises UsageError if it cannot be written.
    """
    if str(path) == "-":
        sys.stdout.buffer.write(content)
    else:
        write_whole(path, lambda part: part.write_bytes(content))
        tell(path)


def tell(path: Path) -> None:
    """A word about a file that was written."""
    click.echo(f"{path}  {path.stat().st_size / 1024:.0f} KiB", err=True)


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a file beside ``path`` and rename it: no half file is ever left.

    Raises UsageError if that cannot be done.
    """
    try:
        number, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
        os.close(number)
        part = Path(name)
        try:
            write(part)
            part.chmod(0o644)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror or error}") from error
