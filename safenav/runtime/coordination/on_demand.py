"""A strategy whose moves are requested from the synthesizer one at a time.

A node is a position that the play has reached; they are numbered as they are first reached. Every
result is checked against the text of the specification before it is used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from safenav.spec.specification import Owner
from safenav.synthesis.serving.served import Position, ServedStrategy
from safenav.verify.moves import MoveCheck


class OnDemand:
    """The moves of a running synthesizer. Raises SynthesizerError if it has ended, or if its result
    breaks the specification. ``most``: the most nodes of an explicit strategy in which ``find``
    still searches."""

    def __init__(self, served: ServedStrategy, most: int) -> None:
        self.specification = served.specification
        self._served = served
        self._most = most
        self._check = MoveCheck(served.specification)
        self._inputs = {variable.name for variable in self.specification.owned(Owner.INPUT)}
        self._positions: list[Position] = []
        self._numbers: dict[tuple[tuple[int, ...], int], int] = {}

    @property
    def pid(self) -> int:
        """Process id."""
        return self._served.pid

    def values(self, node: int) -> dict[str, int]:
        """Return all variables at a node."""
        return dict(self._positions[node].values)

    def find_initial(self, values: Mapping[str, int]) -> int | None:
        """Return the first initial node with these values, None if there is none."""
        position = self._served.start(values)
        if position is None:
            return None
        self._check.start(position)
        return self._number(position)

    def find(self, values: Mapping[str, int]) -> int | None:
        """Return the first node with these values in the explicit strategy, None if there is none.
        If that would be too large, return the first such node among those reached."""
        position = self._served.find(values, self._most)
        if position is not None:
            self._check.position(position)
            if any(position.values[name] != value for name, value in values.items()):
                raise self._check.wrong("a node with values other than those requested")
            return self._number(position)
        for node, met in enumerate(self._positions):
            if all(met.values[name] == value for name, value in values.items()):
                return node
        return None

    def alike(self, node: int) -> tuple[int, ...]:
        """Return the other nodes with the same values, of those reached."""
        values = self._positions[node].values
        return tuple(n for n, p in enumerate(self._positions) if n != node and p.values == values)

    def successors_for(self, node: int, inputs: Mapping[str, int]) -> Sequence[int]:
        """The node after these next inputs; empty if the assumptions exclude them, or if some were
        not observed."""
        if not self._inputs <= inputs.keys():
            return ()
        here = self._positions[node]
        move = self._served.move(here, inputs)
        if move is None:
            self._check.refusal(here, inputs)
            return ()
        self._check.move(here, inputs, move)
        return (self._number(move.to),)

    def close(self) -> None:
        """End the process."""
        self._served.close()

    def _number(self, position: Position) -> int:
        key = (tuple(position.values.values()), position.goal)
        found = self._numbers.setdefault(key, len(self._positions))
        if found == len(self._positions):
            self._positions.append(position)
        return found
