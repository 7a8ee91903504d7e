"""Breaks automata in small ways, as a faulty synthesizer would, to see whether a checker notices.

Some damage is harmless (another successor may be as good), so the judge is the oracle's checker,
not the kind of damage.  A damage gets the automaton, its initial nodes and a source of chance.
"""

from collections.abc import Callable
from dataclasses import replace
from random import Random

import networkx

from oracle.automaton import Automaton, Node

Damage = Callable[[Automaton, list[int], Random], Automaton]


def wrong_bit(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One bit of one state is flipped."""
    if not automaton.variables:
        return automaton
    number = source.randrange(len(automaton.nodes))
    bit = 1 << source.randrange(len(automaton.variables))
    node = automaton.nodes[number]
    return _with_node(automaton, number, replace(node, state=node.state ^ bit))


def missing_successor(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One transition is gone."""
    number, position = _some_edge(automaton, source)
    node = automaton.nodes[number]
    kept = node.successors[:position] + node.successors[position + 1 :]
    return _with_node(automaton, number, replace(node, successors=kept))


def extra_successor(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One transition too many."""
    number, _ = _some_edge(automaton, source)
    node = automaton.nodes[number]
    more = (*node.successors, source.randrange(len(automaton.nodes)))
    return _with_node(automaton, number, replace(node, successors=more))


def other_successor(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One transition leads elsewhere, if possible to the same inputs and a cycle."""
    number, position = _some_edge(automaton, source)
    node = automaton.nodes[number]
    target = source.choice((number, source.randrange(len(automaton.nodes))))
    changed = (*node.successors[:position], target, *node.successors[position + 1 :])
    return _with_node(automaton, number, replace(node, successors=changed))


def no_memory(automaton: Automaton, starts: list[int], source: Random) -> Automaton:
    """Transitions keep their state and may forget which goal they were for: goals may starve."""
    twins: dict[int, list[int]] = {}
    for number, node in enumerate(automaton.nodes):
        twins.setdefault(node.state, []).append(number)

    def moved(successor: int) -> int:
        return source.choice(twins[automaton.nodes[successor].state])

    nodes = [replace(n, successors=tuple(map(moved, n.successors))) for n in automaton.nodes]
    return without_unreachable(replace(automaton, nodes=tuple(nodes)), starts)


def missing_start(automaton: Automaton, _starts: list[int], _source: Random) -> Automaton:
    """Node 0 is gone, and with it every transition to it."""
    nodes = [
        replace(node, successors=tuple(s - 1 for s in node.successors if s > 0))
        for node in automaton.nodes[1:]
    ]
    return replace(automaton, nodes=tuple(nodes))


DAMAGES: tuple[Damage, ...] = (
    wrong_bit,
    missing_successor,
    extra_successor,
    other_successor,
    no_memory,
    missing_start,
)


def without_unreachable(automaton: Automaton, starts: list[int]) -> Automaton:
    graph = networkx.DiGraph(
        (n, to) for n, node in enumerate(automaton.nodes) for to in node.successors
    )
    graph.add_nodes_from(starts)
    kept = sorted({*starts}.union(*(networkx.descendants(graph, start) for start in starts)))
    number = {old: new for new, old in enumerate(kept)}
    nodes = (automaton.nodes[n] for n in kept)
    return replace(
        automaton,
        nodes=tuple(
            replace(node, successors=tuple(number[to] for to in node.successors)) for node in nodes
        ),
    )


def _some_edge(automaton: Automaton, source: Random) -> tuple[int, int]:
    numbers = [i for i, node in enumerate(automaton.nodes) if node.successors]
    number = source.choice(numbers)
    return number, source.randrange(len(automaton.nodes[number].successors))


def _with_node(automaton: Automaton, number: int, node: Node) -> Automaton:
    nodes = (*automaton.nodes[:number], node, *automaton.nodes[number + 1 :])
    return replace(automaton, nodes=nodes)
