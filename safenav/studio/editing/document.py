"""The edited text with its history: undo and redo."""

from __future__ import annotations

import time
from itertools import count
from pathlib import Path

from msgspec import Struct, field

MOST = 500
TYPING = 1.2
"""Seconds within which typed changes are undone together."""


class TextOrigin(Struct, eq=False):
    """The origin of a text. ``file``: the file that it is saved to, if any; ``foreign``: it came by
    upload; ``saved``: the content of the file, or the initial text, which needs no saving;
    ``number``: distinguishes origins."""

    file: Path | None = None
    foreign: bool = False
    saved: str | None = None
    number: int = field(default_factory=count().__next__)


_Texts = list[tuple[str, TextOrigin]]


class OpenDocument(Struct):
    """Owner of the text. ``revision`` grows with every change. Undo also restores the origin, so
    that a text is never saved to the file of another."""

    text: str
    origin: TextOrigin = field(default_factory=TextOrigin)
    revision: int = 0
    _before: _Texts = field(default_factory=list)
    _after: _Texts = field(default_factory=list)
    _typed: float = 0.0

    @property
    def undoable(self) -> bool:
        return bool(self._before)

    @property
    def redoable(self) -> bool:
        return bool(self._after)

    @property
    def dirty(self) -> bool:
        return self.text != self.origin.saved

    def change(self, text: str, *, typed: bool = False, origin: TextOrigin | None = None) -> bool:
        """Replace the text, and its ``origin`` if one is given; return whether anything changed.
        ``typed``: changes within ``TYPING`` seconds are undone together."""
        if text == self.text and origin is None:
            return False
        now = time.monotonic()
        if not (typed and self._before and now - self._typed < TYPING):
            self._before.append((self.text, self.origin))
            del self._before[:-MOST]
        self._typed = now if typed else 0.0
        self._after.clear()
        self.text, self.origin = text, origin or self.origin
        self.revision += 1
        return True

    def undo(self) -> None:
        """Restore the previous text, if there is one."""
        self._exchange(self._before, self._after)

    def redo(self) -> None:
        """Restore the last undone text, if there is one."""
        self._exchange(self._after, self._before)

    def _exchange(self, source: _Texts, target: _Texts) -> None:
        if source:
            target.append((self.text, self.origin))
            self.text, self.origin = source.pop()
            self.revision += 1
            self._typed = 0.0
