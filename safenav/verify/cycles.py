"""The transitions of an automaton and their cycles: strongly connected components, walks in them.

Liveness is about events that recur infinitely often, so all of it is decided on cycles. An edge is
known by its place in the row of all; a set of edges is a plane (``verify.bitparallel``): an integer
with a bit for each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, compress, repeat
from operator import and_, eq, ne

from safenav.components import components, path_to, shortest_paths

_ROUNDS = 10
"""Edges are removed together until this multiple of their number has been visited."""

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
        """Return for each edge 1 if it is in the set, else 0."""
        return f"{plane:0{len(self)}b}".encode().translate(_BITS)[::-1]


def cyclic_parts(edges: Iterable[Edge]) -> dict[int, int]:
    """The nodes that lie on a cycle of ``edges``, each with the number of its component."""
    successors = _successors(edges)
    indegree = Counter(chain.from_iterable(successors.values()))
    ready = [node for node in successors if node not in indegree]
    while ready:  # no cycle leads there: usually everything, and cheaper than a full search
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
    """A walk over ``edges`` of one component that takes each ``required`` edge and returns to
    its first node (which is not repeated at the end)."""
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
    """A closed walk over the ``allowed`` edges on which each condition is met by some edge; None
    if there is none. ``unmet`` are for each condition the edges that do not meet it; all these
    sets are planes (``verify.bitparallel``)."""
    may = edges.flags(allowed)
    sources, targets = list(compress(edges.sources, may)), list(compress(edges.targets, may))
    loops = set(compress(sources, map(eq, sources, targets)))
    parts = cyclic_parts(_core(sources, targets))
    parts |= {node: -1 - node for node in loops - parts.keys()}  # each a component of its own
    from_parts = map(and_, may, map(parts.__contains__, edges.sources))
    begun = list(compress(range(len(edges)), from_parts)) if parts else []
    owner = {row: parts[edges.sources[row]] for row in begun}
    inside = [row for row in begun if parts.get(edges.targets[row]) == owner[row]]
    missing = [edges.flags(plane) for plane in unmet] if inside else []
    left = {owner[row] for row in inside}
    for misses in missing:
        left &= {owner[row] for row in inside if not misses[row]}
    if not left:
        return None
    chosen = next(owner[row] for row in inside if owner[row] in left)
    walked = [row for row in inside if owner[row] == chosen]
    required = [next(row for row in walked if not misses[row]) for misses in missing]
    return closed_walk([edges[i] for i in walked], [edges[i] for i in required])


def _core(sources: list[int], targets: list[int]) -> Iterator[Edge]:
    """Those of some edges, loops apart, that may lie on a cycle: without those from nodes that
    have no predecessor, or to nodes that have no successor. Done for all edges together,
    repeatedly: that costs a tenth of visiting edges one by one, and usually it leaves nothing."""
    keep: Iterable[bool] = map(ne, sources, targets)
    effort = _ROUNDS * len(sources)
    while sources and effort >= 0:
        effort -= len(sources)
        chosen = list(keep)
        sources, targets = list(compress(sources, chosen)), list(compress(targets, chosen))
        tails, heads = set(sources), set(targets)
        if tails == heads:
            break
        keep = map(and_, map(heads.__contains__, sources), map(tails.__contains__, targets))
    return zip(sources, targets, strict=True)
