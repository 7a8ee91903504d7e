"""JSON that every program reads alike. It needs only Python's library: bundles contain it.

Python accepts more than the standard, and of two equal keys it takes the last, other programs the
first. So a file could mean one thing to a program and another to its checker.
"""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

MOST_NUMBER = 2**53 - 1
"""Greatest whole number that all programs represent exactly."""
_DIGITS = len(str(MOST_NUMBER)) + 1
_SHOWN = 40
"""Characters of a key or number in a message."""


class JsonError(ValueError):
    """A text that is JSON to some programs only, and the reason."""


def read_json(text: str | bytes) -> Any:
    """Return the value of a JSON text in UTF-8. Raises ValueError (``JsonError`` for a repeated
    key, a number beyond 2**53 - 1, and too many levels)."""
    text = text.decode("utf-8") if isinstance(text, bytes) else text
    try:
        return json.loads(
            text,
            object_pairs_hook=_object,
            parse_int=_whole,
            parse_float=_fraction,
            parse_constant=_constant,
        )
    except RecursionError:
        raise JsonError("too deeply nested") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        twice = next(key for key, count in counts.items() if count > 1)
        raise JsonError(f"the key {twice[:_SHOWN]!r} appears twice in an object")
    return found


def _whole(digits: str) -> int:
    if len(digits) > _DIGITS or abs(number := int(digits)) > MOST_NUMBER:
        raise JsonError(f"the number {digits[:_SHOWN]} is beyond {MOST_NUMBER}")
    return number


def _fraction(digits: str) -> float:
    if abs(number := float(digits)) > MOST_NUMBER:
        raise JsonError(f"the number {digits[:_SHOWN]} is beyond {MOST_NUMBER}")
    return number


def _constant(word: str) -> float:
    raise JsonError(f"{word} is not a number of JSON")
