"""A violated rule of a motion."""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct

NEAR = 1e-7
"""Metres, seconds, radians: what the rounding of a file can explain."""


class Finding(Struct, frozen=True):
    """A broken rule: when (seconds), who, which rule, and what was found in metres and seconds."""

    t: float
    robot: str
    rule: str
    found: str

    def __str__(self) -> str:
        who = f"{self.robot}: " if self.robot else ""
        return f"t = {self.t:.3f} s: {who}{self.found} [{self.rule}]"


Report = Callable[[Finding], None]
