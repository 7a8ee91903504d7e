"""Defects of a map file, worded so that the user can fix them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

MAX_BYTES = 150_000_000
"""Largest size of a map file."""


class Flaw(NamedTuple):
    """One defect; ``line`` and ``column`` count from 1, 0 if it has no place in the file."""

    found: str
    hint: str = ""
    line: int = 0
    column: int = 0


class MapFileError(Exception):
    """A map file cannot be used: all its flaws."""

    def __init__(self, *flaws: Flaw) -> None:
        self.flaws: Sequence[Flaw] = flaws
        super().__init__("; ".join(flaw.found for flaw in flaws))
