"""Options that name what a command writes: tried before it begins, so that no work is lost."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.errors import UsageError
from safenav.outfile import try_folder, try_out


class _Output(click.ParamType[Path]):
    """A path to write; ``-`` is standard output. Raises UsageError where nothing can be written.

    ``endings``: those of files; with any other ending it is a folder. None: always a file.
    """

    name = "path"

    def __init__(self, endings: tuple[str, ...] | None = None) -> None:
        self._endings = endings

    def convert(
        self, value: str | Path, param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        del param, ctx
        path = Path(value)
        if self._endings is not None and path.suffix not in self._endings:
            try_folder(path)
        elif str(path) != "-":
            try_out(path)
        return path


def made_folder(folder: Path) -> Path:
    """The folder, made if it is missing. Raises UsageError where that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"cannot write to {folder}: {error.strerror}") from error
    return folder


FILE = _Output()
FOLDER = _Output(())
TRACE_PAGE_OR_FOLDER = _Output((".jsonl", ".html"))
BUNDLE = _Output((".zip",))
