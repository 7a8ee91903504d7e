"""Strategies as graphs, and the checks of one against the demands of a scenario (``tasks``).

The nodes of a strategy hold a value of every variable: inputs of the environment, and the robot's
own. It keeps the demands if
1. from each node there is one edge for each next input that can occur, and each edge is allowed;
2. each infinite path meets every goal infinitely often, or misses an assumption forever from some
   point on. A *measure* shows that: see ``check_measure``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

from safenav.judge.world import closure

MOST_EDGES = 500_000
BIT = re.compile(r"(?a)([A-Za-z_]\w*)(?:@(\d{1,3})(?:\.(\d{1,9})\.(\d{1,9}))?)?")
"""The name of a bit: of a truth ``x``, or of a number ``x@0.LEAST.MOST``, ``x@1``, and so on."""

Row = tuple[int, ...]
Edges = tuple[Sequence[int], Sequence[int]]  # the node before each edge, and the one after it
Met = list[bool]  # for each edge


class RefusedError(Exception):
    """A part of a bundle does not prove what it should."""


class BundleTooLargeError(Exception):
    """A part of a bundle exceeds the limits of this checker."""


def require(holds: object, reason: str) -> None:
    if not holds:
        raise RefusedError(reason)


class Strategy:
    """A strategy or counterstrategy. ``columns``: each variable's value in each node; ``next``: the
    nodes that follow; ``inputs``: the values of ``names`` in each node."""

    def __init__(self, document: Any, names: Sequence[str]) -> None:
        nodes = [document["nodes"][str(k)] for k in range(len(document["nodes"]))]
        bits = [BIT.fullmatch(bit) for bit in document["variables"]]
        self.count, self.names, self.columns = len(nodes), names, dict[str, list[int]]()
        for node, given in enumerate(nodes):
            good = len(given["state"]) == len(bits) and {*given["state"]} <= {0, 1}
            good = good and all(0 <= target < self.count for target in given["trans"])
            require(good, f"node {node} does not hold {len(bits)} bits, or leads nowhere")
        most, bit_of = dict[str, int](), dict[str, int]()
        for at, (text, bit) in enumerate(zip(document["variables"], bits, strict=True)):
            number = int(bit[2] or 0) if bit else -1
            if bit is None or (bit[2] is None or bit[3] is not None) is not (number == 0):
                raise RefusedError(f"{text} is not a bit of a variable")
            require(number == bit_of.get(bit[1], 0), f"the bit {text} is not the next one")
            bit_of[bit[1]] = number + 1
            column = self.columns.setdefault(bit[1], [int(bit[3] or 0)] * self.count)
            most.setdefault(bit[1], int(bit[4] or 1))
            each = zip(column, nodes, strict=True)
            self.columns[bit[1]] = [n + (given["state"][at] << number) for n, given in each]
        for name, column in self.columns.items():
            require(max(column, default=0) <= most[name], f"a value of {name} is out of its range")
        if missing := {*names} - {*self.columns}:
            raise RefusedError(f"the strategy has no input {', '.join(sorted(missing))}")
        self.inputs = self.rows(names)
        self.next = [[*given["trans"]] for given in nodes]
        if (size := sum(map(len, self.next))) > MOST_EDGES:
            raise BundleTooLargeError(f"{size} edges; this checker accepts {MOST_EDGES}")

    def rows(self, names: Iterable[str]) -> list[Row]:
        """Return each node's values of some variables."""
        columns = [self.columns[name] for name in names]
        return [*zip(*columns, strict=True)] if columns else [()] * self.count

    def values(self, node: int, names: Iterable[str]) -> dict[str, int | None]:
        """Return some values of a node; None for a variable that the strategy lacks."""
        return {n: self.columns[n][node] if n in self.columns else None for n in names}

    def reach(self, begin: Iterable[int]) -> list[int]:
        """Return the nodes that are reachable from some nodes."""
        return sorted(closure({*begin}, lambda node: self.next[node]))

    def edges(self, nodes: Sequence[int]) -> Edges:
        sources = [node for node in nodes for _ in self.next[node]]
        return sources, [*chain(*(self.next[node] for node in nodes))]


def check_strategy(task: Any, nodes: Sequence[int], measures: Any) -> None:
    """Refuse unless the strategy of a task keeps its demands in these nodes. ``measures``: one for
    each goal."""
    graph = task.graph
    for node in nodes:
        inputs = [graph.inputs[target] for target in graph.next[node]]
        missing = sorted(task.expected(task.asked[node]) - {*inputs})[:1]
        message = f"node {node} has no successor for {missing} of {[*graph.names]}"
        require(not missing, f"{message}, which can occur by the scenario")
        require(len({*inputs}) == len(inputs), f"node {node} has two successors for one input")
    edges = graph.edges(nodes)
    for node, target in zip(*edges, strict=True):
        if not task.allows(node, target):
            where = f"from {task.poses[node]} to {task.poses[target]}"
            message = f"the scenario forbids the edge from node {node} to node {target}: {where}"
            seen = graph.values(target, graph.names)
            raise RefusedError(f"{message}, observing {seen}")
    goals, assumed = task.met(edges)
    for k, (met, measure) in enumerate(zip(goals, measures, strict=True)):
        check_measure(edges, f"goal {k} of the scenario", met, assumed, measure)


def check_counterstrategy(task: Any, proof: Mapping[str, Any]) -> None:
    """Refuse unless the counterstrategy of a task defeats every strategy that keeps its demands.
    The environment begins with the input ``start`` and continues from node v with ``chosen[v]``:
    that can occur, and each reply to it has a node. Each infinite path meets every assumption
    infinitely often (a measure for each), and misses a goal forever from some point on (one
    measure, whose excuses are the goals)."""
    graph, start = task.graph, tuple(proof["start"])
    chosen = [*map(tuple, proof["chosen"])]
    require(start == task.opening, "the initial input cannot occur")
    begin = task.answered(start)
    missing = task.openings() - {task.done[node] for node in begin}
    require(not missing, f"the robot could begin with {missing}")
    for node in (nodes := graph.reach(begin)):
        row, after = chosen[node], graph.next[node]
        occurs = row in task.expected(task.asked[node])
        require(occurs, f"the input chosen in node {node} cannot occur")
        listed = {task.done[target] for target in after if graph.inputs[target] == row}
        missing = task.replies(node, row) - listed
        require(not missing, f"in node {node} the robot could continue to {missing}")
    edges, (*each, last) = graph.edges(nodes), proof["measures"]
    goals, assumed = task.met(edges)
    for k, (met, measure) in enumerate(zip(assumed, each, strict=bool(edges[0]))):
        check_measure(edges, f"assumption {k}, infinitely often", met, [], measure)
    never = [False] * len(edges[0])
    check_measure(edges, "a goal is missed forever", never, goals, last)


def check_measure(edges: Edges, what: str, met: Met, excuses: list[Met], given: Any) -> None:
    """Refuse unless each infinite path of these edges meets the goal infinitely often, or one of
    the ``excuses`` never again from some point on.

    A measure gives each node a number n and perhaps an excuse a. On each edge that does not meet
    the goal n falls; or n and a stay the same, and a is not met. Once the goal is no longer met n
    never rises, so at some point it stays; from there on a stays as well, and is not met."""
    numbers, which = given["n"], given["a"]
    whole = all(type(n) is int and n >= 0 for n in numbers)
    good = whole and all(a is None or 0 <= a < len(excuses) for a in which)
    require(good, f"{what}: the measure has a negative value or names an unknown assumption")
    for edge in (edge for edge, good in enumerate(met) if not good):
        source, target = edges[0][edge], edges[1][edge]
        excuse, stays = which[source], numbers[target] == numbers[source]
        stays = stays and excuse is not None and excuse == which[target]
        stays = stays and not excuses[excuse][edge]
        if not (stays or numbers[target] < numbers[source]):
            raise RefusedError(
                f"{what}: the measure does not decrease from node {source} to node {target}"
            )
