"""The text that is being edited, with everything that it was before: undo and redo."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

MOST = 500
TYPING = 1.2
"""Seconds within which typed changes are undone together."""


@dataclass
class OpenDocument:
    """Owner of the text. ``revision`` grows with every change; ``saved``: what the file holds."""

    text: str
    saved: str | None = None
    revision: int = 0
    _before: list[str] = field(default_factory=list)
    _after: list[str] = field(default_factory=list)
    _typed: float = 0.0

    @property
    def undoable(self) -> bool:
        return bool(self._before)

    @property
    def redoable(self) -> bool:
        return bool(self._after)

    def change(self, text: str, *, typed: bool = False) -> bool:
        """Another text; whether it is another one."""
        if text == self.text:
            return False
        now = time.monotonic()
        if not (typed and self._before and now - self._typed < TYPING):
            self._before.append(self.text)
            del self._before[:-MOST]
        self._typed = now if typed else 0.0
        self._after.clear()
        self.text = text
        self.revision += 1
        return True

    def undo(self) -> None:
        """Back to the text before, if there is one."""
        if self._before:
            self._after.append(self.text)
            self.text = self._before.pop()
            self.revision += 1
            self._typed = 0.0

    def redo(self) -> None:
        """What was undone last, again."""
        if self._after:
            self._before.append(self.text)
            self.text = self._after.pop()
            self.revision += 1
