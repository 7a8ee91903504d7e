"""Strongly connected components of a graph, in one pass (Tarjan: SIAM J. Comput. 1972)."""

from __future__ import annotations

from collections.abc import Sequence

Graph = Sequence[Sequence[int]]
"""The successors of each node."""


def components(graph: Graph) -> list[list[int]]:
    """The strongly connected components; whatever a component leads to comes before it."""
    found: list[list[int]] = []
    index = [-1] * len(graph)
    low = [0] * len(graph)
    on_stack = [False] * len(graph)
    stack: list[int] = []
    count = 0
    for root in range(len(graph)):
        if index[root] >= 0:
            continue
        work = [(root, iter(graph[root]))]
        index[root] = low[root] = count
        count += 1
        stack.append(root)
        on_stack[root] = True
        while work:
            node, targets = work[-1]
            for target in targets:
                if index[target] < 0:
                    index[target] = low[target] = count
                    count += 1
                    stack.append(target)
                    on_stack[target] = True
                    work.append((target, iter(graph[target])))
                    break
                if on_stack[target]:
                    low[node] = min(low[node], index[target])
            else:
                work.pop()
                if work:
                    parent = work[-1][0]
                    low[parent] = min(low[parent], low[node])
                if low[node] == index[node]:
                    members: list[int] = []
                    while not members or members[-1] != node:
                        members.append(stack.pop())
                        on_stack[members[-1]] = False
                    found.append(members)
    return found
