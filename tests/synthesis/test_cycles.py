"""Cycles and walks in large graphs, and where there are none; others: ``test_verify_random``."""

import random
from itertools import pairwise

import networkx as nx
import pytest

from safenav.components import path_to, shortest_paths
from safenav.verify.cycles import Edges, cyclic_parts, fair_cycle


def test_a_long_cycle_needs_no_recursion() -> None:
    count = 100_000
    edges = [(n, (n + 1) % count) for n in range(count)]
    assert set(cyclic_parts(edges).values()) == {0}
    assert cyclic_parts(edges[:-1]) == {}
    assert cyclic_parts([(0, 0), (0, 1), (1, 2), (2, 2)]).keys() == {0, 2}


def test_paths_are_shortest_from_the_nearest_beginning() -> None:
    graph = {0: [1, 3], 1: [2, 0], 2: [3, 4], 3: [0], 4: [], 5: []}
    paths = shortest_paths([0], graph.__getitem__)
    assert [*paths] == [0, 1, 3, 2, 4]
    assert path_to(4, paths) == (0, 1, 2, 4)
    assert path_to(3, shortest_paths([1, 2], graph.__getitem__)) == (2, 3)
    assert path_to(0, paths) == (0,)


def test_a_long_way_is_no_cycle() -> None:
    count = 10_000
    edges = Edges(range(count), [*([n + 1] for n in range(count - 1)), []])
    assert fair_cycle(edges, (1 << count) - 1, ()) is None


@pytest.mark.parametrize("first", range(0, 300, 100))
def test_classes_of_nodes_change_no_verdict(first: int) -> None:
    for seed in range(first, first + 100):
        _compare(random.Random(seed))


def _compare(rng: random.Random) -> None:
    count, conditions = rng.randint(1, 8), rng.randint(0, 2)
    successors = [rng.sample(range(count), rng.randint(0, min(3, count))) for _ in range(count)]
    edges = Edges(range(count), successors)
    allowed = rng.getrandbits(len(edges) + 1) >> 1
    unmet = [rng.getrandbits(len(edges) + 1) >> 1 for _ in range(conditions)]
    classes = {node: rng.randrange(3) for node in range(count)}
    cycle = fair_cycle(edges, allowed, unmet, classes)
    pairs = list(edges)
    graph = nx.MultiDiGraph(pair for row, pair in enumerate(pairs) if allowed >> row & 1)
    inside = [
        [row for row, ends in enumerate(pairs) if allowed >> row & 1 and part.issuperset(ends)]
        for part in nx.strongly_connected_components(graph)
    ]
    fair = any(
        rows and all(any(not plane >> row & 1 for row in rows) for plane in unmet)
        for rows in inside
    )
    assert (cycle is not None) == fair == (fair_cycle(edges, allowed, unmet) is not None)
    if cycle is not None:
        walked = {pairs.index(ends) for ends in pairwise((*cycle, cycle[0]))}
        assert all(allowed >> row & 1 for row in walked)
        assert all(any(not plane >> row & 1 for row in walked) for plane in unmet)
