"""Cycles and walks in large graphs, and where there are none; others: ``test_verify_random``."""

from safenav.verify.cycles import cyclic_parts


def test_a_long_cycle_needs_no_recursion() -> None:
    count = 100_000
    edges = [(n, (n + 1) % count) for n in range(count)]
    assert set(cyclic_parts(edges).values()) == {0}
    assert cyclic_parts(edges[:-1]) == {}
    assert cyclic_parts([(0, 0), (0, 1), (1, 2), (2, 2)]).keys() == {0, 2}
