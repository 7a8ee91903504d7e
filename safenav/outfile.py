"""Atomic writing of output files."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import click

from safenav.errors import UsageError


def write_out(path: Path, content: str | bytes, *, echo: bool = True, replace: bool = True) -> None:
    """Write a file (``-``: standard output), and report it if ``echo``. ``replace``: overwrite an
    existing file.

    Raises UsageError if it cannot be written.
    """
    data = _bytes(content)
    if str(path) == "-":
        sys.stdout.buffer.write(data)
        return
    write_whole(path, lambda part: part.write_bytes(data), replace=replace)
    if echo:
        tell(path)


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def try_out(path: Path) -> None:
    """Raises UsageError unless a file of this name can be written. Leaves nothing behind."""
    try:
        if path.is_dir():
            raise IsADirectoryError(0, "it is a folder")
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError(0, "permission denied")
        if not path.exists() or path.is_file():
            _new_file(path.parent).unlink()
    except OSError as error:
        raise _failure(path, error) from error


def try_folder(path: Path) -> None:
    """Raises UsageError unless files can be written into a folder, which need not exist yet."""
    there = next((p for p in (path, *path.absolute().parents) if p.exists()), path)
    try:
        _new_file(there).unlink()
    except OSError as error:
        raise _failure(path, error) from error


def _new_file(folder: Path, prefix: str = ".") -> Path:
    """Return a new file in a folder, readable by this user only."""
    file = folder / f"{prefix}{os.urandom(6).hex()}"
    os.close(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    return file


def _failure(path: Path, error: OSError) -> UsageError:
    return UsageError(f"cannot write {path}: {error.strerror or error}")


def tell(path: Path) -> None:
    """Report name and size of a written file on standard error."""
    click.echo(f"{path}  {path.stat().st_size / 1024:.0f} KiB", err=True)


def write_whole(path: Path, write: Callable[[Path], object], *, replace: bool = True) -> None:
    """Let ``write`` fill a file beside ``path``, then rename it: an incomplete file is never left.
    Devices and pipes are written directly. ``replace``: overwrite an existing file.

    Raises UsageError if that cannot be done.
    """
    try:
        if path.exists() and not path.is_file():
            write(path)
            return
        part = _new_file(path.parent, f".{path.name}-")
        try:
            write(part)
            part.chmod(0o644)
            if replace:
                part.replace(path)
            else:
                os.link(part, path)  # unlike a renaming it fails if the name is taken
        finally:
            part.unlink(missing_ok=True)
    except FileExistsError:
        hint = "choose another name, or replace it with --force"
        raise UsageError(f"{path} already exists\n    {hint}") from None
    except OSError as error:
        raise _failure(path, error) from error


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Signals that end the program wait for the end of this context."""
    came: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, lambda number, _: came.append(number)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
    for each in came:
        signal.raise_signal(each)


def write_all(folder: Path, files: Iterable[tuple[str, str | bytes]]) -> None:
    """Write files by their names into a folder, which need not exist: all of them or none.

    Raises UsageError if that cannot be done.
    """
    # Imported here: it loads the modules of all archives, which takes 2 ms.
    from tempfile import TemporaryDirectory

    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=".") as scratch:
            for name, content in files:
                Path(scratch, name).write_bytes(_bytes(content))
            with _uninterrupted():  # no mix of old and new files
                for part in Path(scratch).iterdir():
                    part.replace(folder / part.name)
    except OSError as error:
        for each in missing:
            with contextlib.suppress(OSError):
                each.rmdir()
        raise _failure(folder, error) from error
