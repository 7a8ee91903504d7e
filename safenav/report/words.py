"""Small words of messages: numbers with their nouns, articles."""

from __future__ import annotations

_UNCOUNTED = {"debris", "dirt", "dust", "fire", "fog", "glass", "gravel", "ice", "mud", "oil"} | {
    "rubble",
    "sand",
    "smoke",
    "snow",
    "uncertainty",
    "water",
}
"""Kinds of obstacles of which there is no plural, so no article either."""


def counted(number: int, noun: str, plural: str = "") -> str:
    """``1 state``, ``2 states``; ``plural`` where an s is not enough."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def with_article(kind: str) -> str:
    """``a door``, ``an obstacle``, ``rubble``."""
    if kind.lower() in _UNCOUNTED:
        return kind
    return f"{'an' if kind[:1].lower() in tuple('aeiou') else 'a'} {kind}"
