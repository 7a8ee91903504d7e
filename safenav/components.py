"""Graph search and strongly connected components in one pass (Tarjan: SIAM J. Comput. 1972)."""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import TypeVar

Graph = Sequence[Sequence[int]]
"""The successors of each node."""

_State = TypeVar("_State", bound=Hashable)


def reached(
    begins: Iterable[_State], after: Callable[[_State], Iterable[_State]]
) -> dict[_State, _State]:
    """Return the states reachable from ``begins``, the nearest first, mapped to their predecessors
    on shortest paths (initial states: to themselves)."""
    before = {state: state for state in begins}
    queue = list(before)
    for state in queue:
        for other in after(state):
            if other not in before:
                before[other] = state
                queue.append(other)
    return before


def path_to(state: _State, before: Mapping[_State, _State]) -> tuple[_State, ...]:
    """Return the path from an initial state to a state. ``before``: the predecessors from
    ``reached``."""
    path = [state]
    while before[path[-1]] != path[-1]:
        path.append(before[path[-1]])
    return tuple(reversed(path))


def cyclic_parts(after: Mapping[_State, Sequence[_State]]) -> dict[_State, int]:
    """Return the states on cycles, each mapped to the index of its component. ``after``: the
    successors of each state."""
    states = list(after)
    number = {state: k for k, state in enumerate(states)}
    graph = [[number[other] for other in each] for each in after.values()]
    parts = enumerate(components(graph))
    on_cycles = ((n, part) for n, part in parts if len(part) > 1 or part[0] in graph[part[0]])
    return {states[k]: n for n, part in on_cycles for k in part}


def components(graph: Graph) -> list[list[int]]:
    """Return the strongly connected components, each after those that it can reach."""
    found: list[list[int]] = []
    count, done = 0, len(graph) + 1
    low = [0] * (len(graph) + 1)  # 0: new node; ``done``: complete component
    stack: list[int] = []
    work = [(len(graph), -1, iter(range(len(graph))))]  # an extra node with edges to all others
    while work:
        node, number, targets = work[-1]
        for target in targets:
            if not low[target]:
                low[target] = count = count + 1
                stack.append(target)
                work.append((target, count, iter(graph[target])))
                break
            low[node] = min(low[node], low[target])
        else:
            work.pop()
            if low[node] == number:
                members: list[int] = []
                while not members or members[-1] != node:
                    members.append(stack.pop())
                    low[members[-1]] = done
                found.append(members)
            elif work:
                parent = work[-1][0]
                low[parent] = min(low[parent], low[node])
    return found
