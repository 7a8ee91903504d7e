"""Cycles and walks in large graphs, and where there are none; others: ``test_verify_random``."""

import pytest

from safenav.verify.cycles import Edges, cyclic_parts, fair_cycle, shortest_path


def test_a_long_cycle_needs_no_recursion() -> None:
    count = 100_000
    edges = [(n, (n + 1) % count) for n in range(count)]
    assert set(cyclic_parts(edges).values()) == {0}
    assert cyclic_parts(edges[:-1]) == {}
    assert cyclic_parts([(0, 0), (0, 1), (1, 2), (2, 2)]).keys() == {0, 2}


def test_there_may_be_no_path() -> None:
    assert shortest_path({0: [1], 1: [2, 0]}, 0, {2}) == [0, 1, 2]
    with pytest.raises(ValueError, match="no path"):
        shortest_path({0: [1], 1: [0]}, 0, {2})


def test_a_long_way_is_no_cycle() -> None:
    count = 10_000
    edges = Edges(range(count), [*([n + 1] for n in range(count - 1)), []])
    assert fair_cycle(edges, (1 << count) - 1, ()) is None
