"""Columns of samples as text: thousandths, differences, deflated, base64 (read by motion.ts)."""

from __future__ import annotations

import struct
import zlib
from base64 import b64encode
from collections.abc import Iterable, Sequence


def packed(columns: Iterable[Sequence[float]]) -> str:
    """Return all columns one after the other; the first value of each is absolute, the others are
    differences. A difference of less than 128 thousandths takes one byte, any other five."""
    found = bytearray()
    for column in columns:
        before = 0
        for value in column:
            now = round(value * 1000)
            step = now - before
            found += (
                struct.pack("<b", step) if -128 < step < 128 else struct.pack("<bi", -128, step)
            )
            before = now
    return b64encode(zlib.compress(bytes(found), 9)).decode()
