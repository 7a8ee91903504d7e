"""All errors of an input, collected for one report."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from copy import copy
from pathlib import Path
from typing import Self

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, UsageError
from safenav.scenario.yaml.document import Node, Place, Scalar, clipped

MAX_REPORTED = 100


class ReadableFolder(Struct, frozen=True):
    """The folder whose files an input may name; without a folder it may name none."""

    folder: Path | None

    def holds(self, path: Path) -> bool:
        """Return whether a path is inside after following links."""
        if self.folder is None:
            return False
        try:
            return path.resolve().is_relative_to(self.folder.resolve())
        except (OSError, RuntimeError, ValueError):
            return False


class Findings:
    """Diagnostics of one file; ``beside`` returns those of another file of the same input.
    ``reach``: the folder whose files it may name; None for any file."""

    def __init__(self, file: str, reach: ReadableFolder | None = None) -> None:
        self.file = file
        self.reach = reach
        self._found: list[Diagnostic] = []
        self._files = [file]
        self._texts: dict[str, list[str]] = {}

    def beside(self, file: str) -> Self:
        """Return the findings of a file that this one refers to; both are raised together."""
        other = copy(self)
        other.file = file
        self._files.append(file)
        return other

    @property
    def home(self) -> ReadableFolder:
        """The folder of the input itself."""
        return ReadableFolder(Path(self._files[0]).parent)

    def read_from(self, text: str) -> None:
        """Set the text of this file, for messages to quote."""
        self._texts[self.file] = text.split("\n")

    @property
    def lines(self) -> list[str]:
        """The lines of this file."""
        return self._texts.get(self.file, [])

    def add(self, where: Node | Place | None, found: str, hint: str = "") -> None:
        """Add a diagnostic: its place (None: of the whole file), ``found`` and ``hint``."""
        if where is None:
            self._found.append(Diagnostic(self.file, 0, 0, found, hint))
            return
        place = where if isinstance(where, Place) else where.place
        self._found.append(Diagnostic(self.file, place.line, place.column, found, hint))

    def unknown(
        self,
        where: Node | None,
        found: str,
        word: str,
        known: Iterable[str],
        hint: str = "",
        column: int | None = None,
    ) -> None:
        """Report a word that is not ``known``; ``hint``: if no known word is suggested; ``column``:
        that of the word in a text."""
        message = f"{found} '{clipped(word)}'", suggestion(word, known) or hint
        if column is not None and isinstance(where, Scalar):
            self.add_inside(where, column, *message)
        else:
            self.add(where, *message)

    def add_inside(self, node: Scalar, column: int, found: str, hint: str = "") -> None:
        """Report an error at a column of a text: at that column of the file if the text is
        ``literal``, else at its beginning, with the column in the message."""
        if node.literal:
            quote = 1 if node.style else 0
            self.add(Place(node.place.line, node.place.column + quote + column - 1), found, hint)
        else:
            self.add(node, f"{found} (column {column} of the formula)", hint)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics so far, in the order in which they were added."""
        return tuple(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def raise_if_any(self) -> None:
        """Raise InputError with all diagnostics in file order, if there are any."""
        if not self._found:
            return
        rank = {file: index for index, file in reversed(list(enumerate(self._files)))}
        once = dict.fromkeys(self._found)
        ordered = sorted(once, key=lambda d: (rank[d.file], d.line, d.column))
        if len(ordered) > MAX_REPORTED:
            more = f"and {len(ordered) - MAX_REPORTED} more"
            ordered[MAX_REPORTED:] = [Diagnostic(self.file, 0, 0, more)]
        raise InputError([replace(d, source=self._line(d)) for d in ordered])

    def refuse_if_any(self) -> None:
        """Raise UsageError with all diagnostics in one line, if there are any."""
        try:
            self.raise_if_any()
        except InputError as error:
            message = (f"{d.found} ({d.hint})" if d.hint else d.found for d in error.diagnostics)
            raise UsageError("; ".join(message)) from error

    def _line(self, found: Diagnostic) -> str:
        lines = self._texts.get(found.file, [])
        return lines[found.line - 1] if 1 <= found.line <= len(lines) else ""


def closest(word: str, known: Iterable[str], alike: float = 0.6) -> list[str]:
    """Return the known word that was probably meant, if any; ``alike``: similarity from 0 to 1."""
    from difflib import get_close_matches  # only needed for errors

    return get_close_matches(word[:80], sorted(known), n=1, cutoff=alike)


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return a hint with the word that was probably meant, and all known words if they are few."""
    words = sorted(known)
    close = closest(word, words)
    parts = [f"did you mean '{close[0]}'?"] if close else []
    if words and len(words) <= 12:
        parts.append(f"known: {listed(words)}")
    return " ".join(parts)


def listed(words: Collection[str]) -> str:
    """Return the first twelve words from a file, on one line."""
    some = [clipped(word) for word in list(words)[:12]]
    return ", ".join(some) + (", ..." if len(words) > 12 else "")
