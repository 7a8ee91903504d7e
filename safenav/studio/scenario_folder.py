"""The only folder in which the studio opens and saves scenarios."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

from msgspec import Struct

from safenav.errors import UsageError
from safenav.file_kind import another_kind
from safenav.outfile import write_whole
from safenav.scenario.yaml.findings import MAX_BYTES

_ENDINGS = (".yaml", ".yml")
_DEEP = 3
"""Depth of the search, in folders."""
_SEEN = 3000
"""Folder entries after which the search ends: the folder may be a whole disk."""
_MOST = 300
_HEAD = 4096
"""Bytes of a file in which ``safenav:`` is searched."""


class ReplaceError(UsageError):
    """A file that saving would replace: the user decides."""


class ScenarioFolder(Struct, frozen=True):
    """Opens and saves the scenarios below ``folder``."""

    folder: Path

    def names(self) -> list[str]:
        """Return the scenario files below the folder, relative to it, the nearest first."""
        found: list[str] = []
        seen = 0
        for place, folders, files in os.walk(self.folder):
            depth = len(Path(place).relative_to(self.folder).parts)
            folders[:] = sorted(f for f in folders if not f.startswith(".") and depth + 1 < _DEEP)
            for name in sorted(files):
                path = Path(place) / name
                if path.suffix in _ENDINGS and not name.startswith(".") and _is_scenario(path):
                    found.append(path.relative_to(self.folder).as_posix())
            seen += len(folders) + len(files)
            if seen > _SEEN or len(found) >= _MOST:
                break
        return sorted(found[:_MOST], key=lambda name: (name.count("/"), name))

    def path(self, name: str) -> Path:
        """Return the file of that name. Raises UsageError for one outside the folder."""
        pure = PurePosixPath(name)
        hidden = any(part.startswith(".") for part in pure.parts)
        if pure.is_absolute() or hidden or pure.suffix not in _ENDINGS:
            raise UsageError(f"a name in {self.folder} is expected, such as lab.yaml")
        path = self.folder / pure
        if path.is_symlink() or not path.resolve().is_relative_to(self.folder.resolve()):
            raise UsageError(f"{name} is a link to a place outside {self.folder}")
        if not path.parent.is_dir():
            raise UsageError(f"no folder {path.parent}: create it, or choose another name")
        return path

    def name(self, path: Path) -> str:
        """Return a file's path relative to the folder, or its bare name if it is outside."""
        try:
            return path.resolve().relative_to(self.folder.resolve()).as_posix()
        except ValueError:
            return path.name


def read_text(path: Path) -> str:
    """Return the text of a scenario file. Raises UsageError if it cannot be read, or is of another
    kind, which saving would overwrite."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UsageError(f"{path} is larger than {MAX_BYTES // 1_000_000} MB")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read as text: {error}") from error
    if wrong := another_kind(text, "scenario", str(path)):
        raise UsageError("\n    ".join((f"{path}: {wrong[0]}", wrong[1])))
    return text


def save_text(path: Path, text: str, known: str | None, *, replace: bool) -> None:
    """Write a file whole or not at all. ``known``: the content that may be replaced.

    Raises ReplaceError if the file has another content, unless ``replace``.
    """
    if not replace and path.exists():
        try:
            there: str | None = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError):
            there = None
        if there is None or there != known:
            why = "already exists" if known is None else "has changed since it was opened"
            raise ReplaceError(f"{path.name} {why}")
    write_whole(path, lambda part: part.write_text(text, encoding="utf-8"))


def _is_scenario(path: Path) -> bool:
    if path.is_symlink() or not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    return head.startswith(b"safenav:") or b"\nsafenav:" in head
