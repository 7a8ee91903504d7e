"""The order in which targets count: one automaton for objectives, joint plans and the runtime.

Targets are numbers, sets of them masks with a bit for each. The memory is the next target if they
count in turn, else the set of those met in this round.
"""

from __future__ import annotations

from typing import NamedTuple


class Pursuit(NamedTuple):
    """The pursuit of ``targets`` targets. ``in_turn``: they count in their order only;
    ``settles``: it ends at the last one, where each tick is a round."""

    targets: int
    in_turn: bool
    settles: bool

    def met(self, memory: int, here: int) -> int:
        """Return which of the reached targets ``here`` count."""
        return here & 1 << memory if self.in_turn else here

    def awaited(self, memory: int) -> int:
        """Return the targets, one of which must be reached next."""
        return 1 << memory if self.in_turn else (1 << self.targets) - 1 & ~memory

    def step(self, memory: int, here: int) -> tuple[int, int]:
        """Return the memory after a turn in which the targets ``here`` are reached, and the number
        of goals met if targets count in turn, else of rounds; where it settles, only the last
        target is a goal."""
        if not self.in_turn:
            seen = memory | here
            return (seen, 0) if seen + 1 < 1 << self.targets else (0, 1)
        if not here >> memory & 1:
            return memory, 0
        last = memory == self.targets - 1
        if self.settles:
            return memory + (not last), int(last)
        return 0 if last else memory + 1, 1
