"""Minimal failing subset by divide and conquer.

QuickXplain (Junker: Preferred explanations and relaxations for over-constrained problems, AAAI
2004): about 2k log(n/k) + 2k queries for k of n members, where deleting one by one takes n."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

Item = TypeVar("Item")


def minimal_subset(items: Sequence[Item], fails: Callable[[Sequence[Item]], bool]) -> list[Item]:
    """Return a subset that fails, none of whose members can be spared; earlier ones are preferred.

    ``fails`` must hold for ``items`` and be monotone: whatever contains a failing set fails."""
    if fails(()):
        return []
    return _explain([], False, list(items), fails)


def _explain(
    background: list[Item], grown: bool, items: list[Item], fails: Callable[[Sequence[Item]], bool]
) -> list[Item]:
    """Return the items that are needed to fail together with ``background``; ``grown``: whether the
    background has members that were not there at its last query."""
    if grown and fails(background):
        return []
    if len(items) == 1:
        return items
    half = (len(items) + 1) // 2
    first, second = items[:half], items[half:]
    late = _explain([*background, *first], True, second, fails)
    early = _explain([*background, *late], bool(late), first, fails)
    return [*early, *late]
