"""Cycles and walks in graphs."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import networkx
import pytest

from safenav.verify.cycles import closed_walk, cyclic_parts, shortest_path


def test_parts_are_the_strongly_connected_components_with_a_cycle() -> None:
    for seed in range(200):
        source = Random(seed)
        count = source.randrange(1, 30)
        edges = [
            (source.randrange(count), source.randrange(count))
            for _ in range(source.randrange(2 * count))
        ]
        graph = networkx.DiGraph(edges)
        expected = {
            frozenset(component)
            for component in networkx.strongly_connected_components(graph)
            if len(component) > 1 or any(graph.has_edge(n, n) for n in component)
        }
        parts: dict[int, set[int]] = {}
        for node, part in cyclic_parts(edges).items():
            parts.setdefault(part, set()).add(node)
        assert {frozenset(part) for part in parts.values()} == expected


def test_a_long_cycle_needs_no_recursion() -> None:
    count = 100_000
    edges = [(n, (n + 1) % count) for n in range(count)]
    assert set(cyclic_parts(edges).values()) == {0}
    assert cyclic_parts(edges[:-1]) == {}


def test_a_closed_walk_takes_every_required_edge() -> None:
    for seed in range(100):
        source = Random(seed)
        count = source.randrange(2, 12)
        edges = [(n, (n + 1) % count) for n in range(count)]
        edges += [(source.randrange(count), source.randrange(count)) for _ in range(count)]
        required = source.sample(edges, source.randrange(4))
        walk = closed_walk(edges, required)
        steps = set(pairwise((*walk, walk[0])))
        assert set(required) <= steps <= set(edges)


def test_there_may_be_no_path() -> None:
    assert shortest_path({0: [1], 1: [2, 0]}, 0, {2}) == [0, 1, 2]
    with pytest.raises(ValueError, match="no path"):
        shortest_path({0: [1], 1: [0]}, 0, {2})
