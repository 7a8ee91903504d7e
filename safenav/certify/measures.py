"""Progress measures: checkable evidence that a strategy starves no goal.

For a goal each node gets a number ``n`` and perhaps an assumption ``a`` (an index, or None). On
each edge that misses the goal the number falls, or number and assumption stay and the edge misses
that assumption. This form is complete for explicit strategies: a run that starves a goal exists if
and only if some strongly connected component of the edges that miss the goal meets every
assumption. Otherwise ``n`` is the depth of the component in the condensation and ``a`` an
assumption that the component misses. One pass of Tarjan's algorithm (SIAM J. Comput. 1972) per
goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from safenav.components import components


class NoMeasureError(ValueError):
    """No measure exists: a run starves the goal although it meets every assumption."""


Measure = dict[str, list[Any]]
"""Number (``n``) and assumption (``a``) of each node."""


def measure(
    size: int,
    edges: tuple[Sequence[int], Sequence[int]],
    met: Sequence[bool],
    excuses: Sequence[Sequence[bool]],
) -> Measure:
    """Return the measure of a goal.

    ``size``: number of nodes. ``edges``: the node before each edge, and the node after it. ``met``,
    and each of ``excuses`` (assumptions; for a counterstrategy, goals): for each edge, whether it
    is met there. Raises NoMeasureError if no measure exists.
    """
    missing: list[list[tuple[int, int]]] = [[] for _ in range(size)]
    for edge, (source, target) in enumerate(zip(*edges, strict=True)):
        if not met[edge]:
            missing[source].append((target, edge))
    numbers = [0] * size
    assumptions: list[int | None] = [None] * size
    component = [-1] * size
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
                (k for k, e in enumerate(excuses) if not any(e[edge] for edge in inside)), None
            )
            if excuse is None:
                raise NoMeasureError(f"node {members[0]} lies on a cycle that starves the goal")
        for node in members:
            numbers[node] = depth
            assumptions[node] = excuse
    return {"n": numbers, "a": assumptions}
