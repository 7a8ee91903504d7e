"""Cycles and walks in graphs."""

from itertools import pairwise
from random import Random

import networkx
import pytest

from safenav.verify.cycles import Edges, closed_walk, cyclic_parts, fair_cycle, shortest_path


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


def test_a_fair_cycle_is_found_where_a_component_meets_each_condition() -> None:
    found = 0
    for seed in range(300):
        source = Random(seed)
        nodes = range(source.randrange(1, 25))
        degree = source.choice([1, 1, 2, 3])
        transitions = [source.choices(nodes, k=source.randrange(degree + 1)) for _ in nodes]
        edges = Edges(nodes, transitions)
        allowed = sum(source.choice([0, 1, 1, 1]) << i for i in range(len(edges)))
        unmet = [source.getrandbits(len(edges) + 1) for _ in range(source.randrange(3))]
        met = [{edges[i] for i in range(len(edges)) if (allowed & ~u) >> i & 1} for u in unmet]
        graph = networkx.DiGraph(edges[i] for i in range(len(edges)) if allowed >> i & 1)
        components = map(graph.subgraph, networkx.strongly_connected_components(graph))
        fair = any(part.edges and all(m & set(part.edges) for m in met) for part in components)
        walk = fair_cycle(edges, allowed, unmet)
        assert (walk is not None) == fair
        if walk is not None:
            found += 1
            steps = set(pairwise((*walk, walk[0])))
            assert steps <= set(graph.edges)
            assert all(steps & edges_met for edges_met in met)
    assert 50 < found < 250


def test_a_long_way_is_no_cycle() -> None:
    count = 10_000
    edges = Edges(range(count), [*([n + 1] for n in range(count - 1)), []])
    assert fair_cycle(edges, (1 << count) - 1, ()) is None
