"""Values that change during a run."""

from __future__ import annotations

from bisect import bisect_right
from operator import itemgetter
from typing import TypeVar

T = TypeVar("T")


class Changes(list[tuple[int, T]]):
    """A value over time: pairs of the tick from which a value holds and the value, in order. The
    last of several in one tick counts."""

    @classmethod
    def of(cls, first: T) -> Changes[T]:
        """Return a value that holds from the start."""
        return cls([(-1, first)])

    @property
    def now(self) -> T:
        """The last value."""
        return self[-1][1]

    def put(self, tick: int, value: T) -> None:
        """Change the value, unless it is the same."""
        if value != self.now:
            self.append((tick, value))

    def at(self, tick: int) -> T:
        """Return the value after all events of that tick."""
        return self[max(0, bisect_right(self, tick, key=itemgetter(0)) - 1)][1]
