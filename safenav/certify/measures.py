"""Progress measures: why a strategy starves no goal, written down so that a reader can check it.

For a goal each node gets a number ``n`` and perhaps an assumption ``a`` (an index, or None). On
each edge that misses the goal the number falls, or number and assumption stay and the edge misses
that assumption. For explicit strategies this simple form is complete: a run that starves a goal
exists if and only if some strongly connected component of the edges that miss the goal meets
every assumption. If none does, ``n`` is the depth of the component in the condensation and ``a`` an
assumption that the component misses. One pass of Tarjan's algorithm (SIAM J. Comput. 1972) a goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from safenav.components import Graph, components


class NoMeasureError(ValueError):
    """There is none: a run starves the goal although it meets every assumption."""


@dataclass(frozen=True)
class Measure:
    """Number and assumption of each node."""

    numbers: list[int]
    assumptions: list[int | None]

    def to_data(self) -> dict[str, list[int] | list[int | None]]:
        return {"n": self.numbers, "a": self.assumptions}


def measure(graph: Graph, met: str, excuses: Sequence[str]) -> Measure:
    """The measure of a goal.

    ``met`` and each of ``excuses`` (assumptions, for a counterstrategy goals) have a digit ``1``
    for each edge on which they are met, in the order of sources; edges that do not count are met.
    Raises NoMeasureError if there is none.
    """
    offsets = [0]
    for targets in graph:
        offsets.append(offsets[-1] + len(targets))
    missing = [
        [(target, edge) for edge, target in enumerate(targets, offsets[node]) if met[edge] == "0"]
        for node, targets in enumerate(graph)
    ]
    numbers = [0] * len(graph)
    assumptions: list[int | None] = [None] * len(graph)
    component = [-1] * len(graph)
    for label, members in enumerate(components([[t for t, _ in out] for out in missing])):
        for node in members:
            component[node] = label
        inside, depth = [], 0
        for node in members:
            for target, edge in missing[node]:
                if component[target] == label:
                    inside.append(edge)
                else:
                    depth = max(depth, numbers[target] + 1)
        excuse = None
        if inside:
            excuse = next(
                (k for k, e in enumerate(excuses) if all(e[edge] == "0" for edge in inside)), None
            )
            if excuse is None:
                raise NoMeasureError(f"node {members[0]} lies on a cycle that starves the goal")
        for node in members:
            numbers[node] = depth
            assumptions[node] = excuse
    return Measure(numbers, assumptions)
