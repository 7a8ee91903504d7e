"""Precedence implied by the action dependency graph of a joint plan: which arrival comes before
which departure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping


class Precedence:
    """Events of a plan: each robot departs for its place ``i`` (from 1) and arrives there. A robot
    does so in order; ``(first, i, then, j)``: ``then`` departs for its place ``j`` when ``first``
    has arrived at its place ``i``."""

    def __init__(
        self, lengths: Mapping[str, int], orders: Iterable[tuple[str, int, str, int]]
    ) -> None:
        self._lengths = dict(lengths)
        self._number: dict[tuple[str, int], int] = {}
        for robot, length in lengths.items():
            for place in range(length):
                self._number[robot, place] = 2 * len(self._number)
        count = 2 * len(self._number)
        after: list[list[int]] = [[] for _ in range(count)]
        waits = [0] * count

        def edge(one: int, other: int) -> None:
            after[one].append(other)
            waits[other] += 1

        for (robot, place), arrival in self._number.items():
            edge(arrival + 1, arrival)  # an odd number is departing for the place
            if place:
                edge(self._number[robot, place - 1], arrival + 1)
        for first, i, then, j in orders:
            edge(self._number[first, i], self._number[then, j] + 1)
        ready = [event for event in range(count) if not waits[event]]
        sequence: list[int] = []
        while ready:
            event = ready.pop()
            sequence.append(event)
            for other in after[event]:
                waits[other] -= 1
                if not waits[other]:
                    ready.append(other)
        self.has_circle = len(sequence) < count
        # For each event, as bits, all that come after it.
        self._later = [0] * count
        for event in reversed(sequence):
            for other in after[event]:
                self._later[event] |= self._later[other] | 1 << other

    def left_before(self, one: str, i: int, other: str, j: int) -> bool:
        """Return whether ``one`` has certainly left its place ``i`` (arrived at the next) when
        ``other`` departs for its place ``j``."""
        if i + 1 >= self._lengths[one] or j == 0:
            return False
        arrival = self._number[one, i + 1]
        return bool(self._later[arrival] >> (self._number[other, j] + 1) & 1)
