"""The transitions of an automaton and their cycles: strongly connected components, walks in them.

Liveness is about events that recur infinitely often, so all of it is decided on cycles. An edge is
identified by its index among all; a set of edges is a plane (``verify.bitparallel``): an integer
with a bit for each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, compress, repeat

from safenav.components import components, path_to, shortest_paths

Edge = tuple[int, int]

_BITS = bytes.maketrans(b"01", b"\x00\x01")


class Edges:
    """The edges out of ``nodes``, in their order; ``transitions`` has the successors of each node.
    There may be millions, so their ends are two flat lists, and pairs are made on demand."""

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
        """Yield each node with its successors and the index of its first edge."""
        first = 0
        for node, targets in zip(self._nodes, self._successors, strict=True):
            yield node, targets, first
            first += len(targets)

    def flags(self, plane: int) -> bytes:
        """Return for each edge 1 if it is in the set, else 0."""
        return f"{plane:0{len(self)}b}".encode().translate(_BITS)[::-1]


def cyclic_parts(edges: Iterable[Edge]) -> dict[int, int]:
    """Return the nodes that lie on a cycle of ``edges``, each with the number of its component."""
    successors = _successors(edges)
    indegree = Counter(chain.from_iterable(successors.values()))
    ready = [node for node in successors if node not in indegree]
    while ready:  # no cycle leads there; usually removes all nodes, cheaply
        for target in successors.pop(ready.pop(), ()):
            indegree[target] -= 1
            if not indegree[target]:
                ready.append(target)
    nodes = list(successors)
    index = {node: place for place, node in enumerate(nodes)}
    graph = [[index[target] for target in successors[node] if target in index] for node in nodes]
    return {
        nodes[place]: number
        for number, component in enumerate(components(graph))
        for place in component
        if len(component) > 1 or place in graph[place]
    }


def _successors(edges: Iterable[Edge]) -> dict[int, list[int]]:
    successors: dict[int, list[int]] = {}
    for source, target in edges:
        successors.setdefault(source, []).append(target)
    return successors


def closed_walk(edges: Iterable[Edge], required: Sequence[Edge]) -> tuple[int, ...]:
    """Return a walk over ``edges`` of one component that takes each ``required`` edge and returns
    to its first node (which is not repeated at the end)."""
    successors = _successors(edges)
    if not required:
        source = next(iter(successors))
        required = [(source, successors[source][0])]
    walk = [required[0][0]]
    for source, target in (*required, required[0]):
        paths = shortest_paths(walk[-1:], lambda node: successors.get(node, ()))
        walk += (*path_to(source, paths)[1:], target)
    return tuple(walk[:-2])


def fair_cycle(edges: Edges, allowed: int, unmet: Sequence[int]) -> tuple[int, ...] | None:
    """Return a closed walk over the ``allowed`` edges on which each condition is met by some edge;
    None if there is none. ``unmet``: for each condition, the edges that do not meet it. All these
    sets are planes (``verify.bitparallel``)."""
    rows = [*compress(range(len(edges)), edges.flags(allowed))]
    parts = cyclic_parts(edges[row] for row in rows)
    inside: dict[int, list[int]] = {}
    for row in rows:
        part = parts.get(edges.sources[row])
        if part is not None and part == parts.get(edges.targets[row]):
            inside.setdefault(part, []).append(row)
    met = [edges.flags(((1 << len(edges)) - 1) ^ plane) for plane in unmet] if inside else []
    for walked in inside.values():
        required = [next((row for row in walked if flags[row]), None) for flags in met]
        if None not in required:
            return closed_walk(
                [edges[row] for row in walked], [edges[row] for row in required if row is not None]
            )
    return None
