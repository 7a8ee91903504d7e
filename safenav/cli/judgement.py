"""Verdicts of ``safenav check``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct

from safenav.errors import ExitCode


class JudgedFile(Struct, frozen=True):
    """The verdict on a file, as data and in words."""

    status: ExitCode
    data: Mapping[str, Any]
    lines: Sequence[str] = ()
    warnings: Sequence[str] = ()
