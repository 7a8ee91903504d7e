"""The transitions of an automaton and their cycles: strongly connected components, walks in them.

Liveness is about events that recur infinitely often, so all of it is decided on cycles. An edge is
identified by its index among all; a set of edges is a plane (``verify.bitparallel``): an integer
with a bit for each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, compress, repeat
from operator import and_, eq, ne

from safenav.components import components, path_to, shortest_paths

_SAMPLE = 1000
"""Number of edges sampled to decide whether removing edges together is worthwhile."""

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


def fair_cycle(
    edges: Edges, allowed: int, unmet: Sequence[int], classes: Mapping[int, int] | None = None
) -> tuple[int, ...] | None:
    """Return a closed walk over the ``allowed`` edges on which each condition is met by some edge;
    None if there is none. ``unmet``: for each condition, the edges that do not meet it. All these
    sets are planes (``verify.bitparallel``).

    ``classes``: any partition of the nodes. A closed walk of nodes is also a closed walk of
    classes; if there are few classes, searching them first usually suffices.
    """
    may = edges.flags(allowed)
    rows = _core(
        *(list(compress(e, may)) for e in (range(len(edges)), edges.sources, edges.targets))
    )
    met = [edges.flags(((1 << len(edges)) - 1) ^ plane) for plane in unmet] if rows else []
    if classes is not None:
        rows, _ = _recurring(rows, edges, classes, met)
    rows, parts = _recurring(rows, edges, None, met)
    if not rows:
        return None
    chosen = parts[edges.sources[rows[0]]]
    walked = [row for row in rows if parts[edges.sources[row]] == chosen]
    required = [next(row for row in walked if flags[row]) for flags in met]
    return closed_walk([edges[i] for i in walked], [edges[i] for i in required])


def _core(rows: list[int], sources: list[int], targets: list[int]) -> list[int]:
    """Return the edges (``rows``) that may lie on a cycle: remove edges from nodes without
    predecessors or to nodes without successors, except loops. This repeats for all edges together
    while it removes at least a tenth of a sample: it costs a tenth of visiting the edges one by
    one, and often leaves few."""
    loops = list[int]()
    while rows:
        tails, heads = set(sources), set(targets)
        some = slice(None, None, len(rows) // _SAMPLE + 1)
        pairs = list(zip(sources[some], targets[some], strict=True))
        if sum(tail in heads and head in tails for tail, head in pairs) > 0.9 * len(pairs):
            break
        if not loops:
            loops = list(compress(rows, map(eq, sources, targets)))
        proper = map(ne, sources, targets)
        known = map(and_, map(heads.__contains__, sources), map(tails.__contains__, targets))
        kept = list(map(and_, proper, known))
        rows, sources, targets = (list(compress(each, kept)) for each in (rows, sources, targets))
    return sorted(chain(rows, loops)) if loops else rows


def _recurring(
    rows: list[int], edges: Edges, classes: Mapping[int, int] | None, met: Sequence[bytes]
) -> tuple[list[int], dict[int, int]]:
    """Return the edges (``rows``) inside a component, of classes or of nodes, in which some edge
    meets each condition, and the component of each end."""
    tails, heads = (list(map(ends.__getitem__, rows)) for ends in (edges.sources, edges.targets))
    pairs: Iterable[Edge] = zip(tails, heads, strict=True)
    if classes is not None:
        tails, heads = (list(map(classes.__getitem__, ends)) for ends in (tails, heads))
        pairs = set(zip(tails, heads, strict=True))
    parts = cyclic_parts(pairs)
    owned = zip(map(parts.get, tails), heads, strict=True)
    owners = [owner if parts.get(head) == owner else None for owner, head in owned]
    fair = {owner for owner in owners if owner is not None}
    for flags in met:
        fair.intersection_update(compress(owners, map(flags.__getitem__, rows)))
    return [row for row, owner in zip(rows, owners, strict=True) if owner in fair], parts
