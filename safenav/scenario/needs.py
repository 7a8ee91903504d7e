"""Order and fulfilment of an obstacle's needs, for scenarios, simulated worlds and joint plans."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Protocol, TypeVar

_Need = TypeVar("_Need", bound="AnyNeed")
_Robot = TypeVar("_Robot")


class AnyNeed(Protocol):
    """``robots`` distinct robots do ``action``, in one tick if ``together``; ``same``: they are
    among the robots that fulfilled the need before it."""

    @property
    def action(self) -> str: ...

    @property
    def robots(self) -> int: ...

    @property
    def together(self) -> bool: ...

    @property
    def same(self) -> bool: ...


def chain(needs: Sequence[_Need], number: int) -> Sequence[_Need]:
    """Return a need and the needs after it that the same robots must fulfil."""
    last = number + 1
    while last < len(needs) and needs[last].same:
        last += 1
    return needs[number:last]


def takes(needs: Sequence[AnyNeed], number: int) -> bool:
    """Return whether the robots that fulfil a need carry a load from then on: the same robots must
    fulfil the next need, and others may have fulfilled the one before."""
    return number + 1 < len(needs) and needs[number + 1].same and not needs[number].same


def actions(needs: Sequence[AnyNeed], number: int) -> frozenset[str]:
    """Return the actions that a robot must have for a need: that of the need, and those of the
    needs that the same robots must fulfil after it."""
    return frozenset(need.action for need in chain(needs, number))


def group_of(
    need: AnyNeed, done: frozenset[_Robot], here: Collection[_Robot]
) -> tuple[frozenset[_Robot], bool]:
    """Return the robots that have fulfilled their part of a need once those ``here`` have acted,
    and whether the need is then fulfilled. ``done``: the robots that had done their part before."""
    group = done.union(here)
    met = len(group) >= need.robots
    return (group if met or not need.together else done), met
