"""The transitions of an automaton, one after the other: an edge is known by its place in the row.

A set of edges is a plane (``verify.bitparallel``): an integer with a bit for each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, repeat

Edge = tuple[int, int]

_BITS = bytes.maketrans(b"01", b"\x00\x01")


class Edges:
    """The edges out of ``nodes``, in the order of these; ``transitions`` has the successors of
    each node. Millions of them: so the ends are two flat lists, and pairs are made when asked
    for."""

    def __init__(self, nodes: Sequence[int], transitions: Sequence[Sequence[int]]) -> None:
        self._nodes = nodes
        self._successors = [transitions[node] for node in nodes]
        lengths = map(len, self._successors)
        self.sources = list(chain.from_iterable(map(repeat, nodes, lengths)))
        self.targets = list(chain.from_iterable(self._successors))

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, index: int) -> Edge:
        return self.sources[index], self.targets[index]

    def __iter__(self) -> Iterator[Edge]:
        return zip(self.sources, self.targets, strict=True)

    def by_node(self) -> Iterator[tuple[int, Sequence[int], int]]:
        """Each node with its successors and the place of the first edge out of it."""
        first = 0
        for node, targets in zip(self._nodes, self._successors, strict=True):
            yield node, targets, first
            first += len(targets)

    def flags(self, plane: int) -> bytes:
        """For each edge 1 if it is in the set, else 0."""
        return f"{plane:0{len(self)}b}".encode().translate(_BITS)[::-1]
