"""Explicit strategies and counterstrategies: their text, a model checker, and ways to break them.

The text is byte for byte what SLUGS prints, as far as published outputs show it. The checker knows
the specification only through the explicit game and shares nothing with the fixpoints; every node
is taken as reachable. Damage is that of a faulty synthesizer. Some is harmless (another successor
may be as good), so the judge is the checker, not the kind of damage.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from random import Random
from typing import TYPE_CHECKING

import networkx
import numpy as np

from oracle.specification import Specification

if TYPE_CHECKING:
    from oracle.game import Game

Edge = tuple[int, int]


@dataclass(frozen=True)
class Node:
    """A state (as a number, see game.py), the memory, and the ids of the successors."""

    state: int
    rank: int
    successors: tuple[int, ...]


@dataclass(frozen=True)
class Automaton:
    variables: tuple[str, ...]  # bits, as declared
    nodes: tuple[Node, ...]

    @property
    def edges(self) -> list[Edge]:
        return [(n, to) for n, node in enumerate(self.nodes) for to in node.successors]

    def bits(self, node: Node) -> list[int]:
        """The bits of a state in the order in which a strategy prints them."""
        return [node.state >> i & 1 for i in reversed(range(len(self.variables)))]


def to_json(automaton: Automaton) -> str:
    """The JSON that `--explicitStrategy --jsonOutput` prints."""
    nodes = ",\n\n".join(
        f'"{number}": {{\n\t"rank": {node.rank},\n'
        f'\t"state": {automaton.bits(node)},\n\t"trans": {[*node.successors]}\n}}'
        for number, node in enumerate(automaton.nodes)
    )
    end = "\n\n" if automaton.nodes else ""
    variables = json.dumps(automaton.variables)
    return (
        f'{{"version": 0,\n "slugs": "0.0.1",\n\n "variables": {variables},\n\n'
        f' "nodes": {{\n{nodes}{end}}}}}\n'
    )


def to_text(automaton: Automaton) -> str:
    """The text form that `--explicitStrategy` prints alone."""
    lines = []
    for number, node in enumerate(automaton.nodes):
        pairs = zip(automaton.variables, automaton.bits(node), strict=True)
        values = ", ".join(f"{name}:{bit}" for name, bit in pairs)
        lines.append(f"State {number} with rank {node.rank} -> <{values}>\n")
        lines.append(f"\tWith successors : {', '.join(map(str, node.successors))}\n")
    return "".join(lines)


def from_json(specification: Specification, text: str) -> Automaton:
    """Read an automaton back. Raises ValueError or LookupError for another text."""
    data = json.loads(text)
    names, nodes = tuple(data["variables"]), data["nodes"]
    found = [nodes[str(number)] for number in range(len(nodes))]
    states = ["".join(map(str, node["state"])) for node in found]
    if names != specification.bits or any(len(bits) != len(names) for bits in states):
        raise ValueError(f"the variables are {names}")
    if any(not 0 <= to < len(found) for node in found for to in node["trans"]):
        raise ValueError("no such successor")
    return Automaton(
        names,
        tuple(
            Node(int(bits or "0", 2), int(node["rank"]), tuple(node["trans"]))
            for bits, node in zip(states, found, strict=True)
        ),
    )


def check_strategy(game: Game, automaton: Automaton, robotics_init: bool = False) -> list[str]:
    """What is wrong with a strategy of the system; nothing if it is sound."""
    nodes, complaints = automaton.nodes, []
    starts, there = game.env_init & game.sys_init, _states(game, nodes)
    missing = game.inputs_of(game.env_init) & ~game.inputs_of(starts & there)
    if robotics_init:
        missing = starts & ~there
    if missing.any():
        complaints.append("a start is missing")
    for number, node in enumerate(nodes):
        after = [nodes[to].state for to in node.successors]
        if sorted(game.place[s][0] for s in after) != np.flatnonzero(game.env[node.state]).tolist():
            complaints.append(f"node {number} does not answer each input once")
        if not all(game.has(game.sys, node.state, state) for state in after):
            complaints.append(f"node {number} breaks SYS_TRANS")
    for j, goal in enumerate(game.guarantees):
        for cycle in cycles(e for e in automaton.edges if not _meets(game, goal, nodes, e)):
            if all(any(_meets(game, a, nodes, e) for e in cycle) for a in game.assumptions):
                complaints.append(f"nodes {sorted({*cycle})} starve guarantee {j}")
    return complaints


def check_counterstrategy(
    game: Game, automaton: Automaton, robotics_init: bool = False
) -> list[str]:
    """What is wrong with a strategy of the environment."""
    nodes, complaints = automaton.nodes, []
    starts, there = game.env_init & game.sys_init, _states(game, nodes)
    # One play that starts well for the environment is enough: it chooses the first inputs.
    covered = game.inputs_of(game.env_init) & ~game.inputs_of(starts & ~there)
    if robotics_init:
        covered = starts & there
    if not covered.any():
        complaints.append("for no initial input are all initial outputs covered")
    for number, node in enumerate(nodes):
        allowed, moves = game.env[node.state], game.sys[node.state]
        after = [nodes[to].state for to in node.successors]
        if not after:
            if not (allowed & ~moves.any(-1)).any():
                complaints.append(f"node {number} leaves the system a way out")
            continue
        inputs = game.place[after[0]][0]
        if not allowed[inputs]:
            complaints.append(f"node {number} moves against ENV_TRANS")
        if sorted(after) != game.successors[inputs, moves[inputs]].tolist():
            complaints.append(f"node {number} does not cover the outputs of SYS_TRANS once each")
    for cycle in cycles(automaton.edges):
        if all(any(_meets(game, goal, nodes, e) for e in cycle) for goal in game.guarantees):
            complaints.append(f"nodes {sorted({*cycle})} can satisfy all guarantees")
    for i, assumption in enumerate(game.assumptions):
        starving = (e for e in automaton.edges if not _meets(game, assumption, nodes, e))
        complaints += [f"nodes {sorted({*c})} starve assumption {i}" for c in cycles(starving)]
    return complaints


def _states(game: Game, nodes: Iterable[Node]) -> np.ndarray:
    found = np.zeros_like(game.env_init)
    found[[node.state for node in nodes]] = True
    return found


def _meets(game: Game, goal: np.ndarray, nodes: tuple[Node, ...], edge: Edge) -> bool:
    return game.has(goal, nodes[edge[0]].state, nodes[edge[1]].state)


def cycles(edges: Iterable[Edge]) -> Iterator[list[Edge]]:
    """The strongly connected components that hold a cycle, each as its edges."""
    graph = networkx.DiGraph(edges)
    parts = enumerate(networkx.strongly_connected_components(graph))
    number = {node: k for k, part in parts for node in part}
    inside: dict[int, list[Edge]] = {}
    for source, target in graph.edges:
        if number[source] == number[target]:
            inside.setdefault(number[source], []).append((source, target))
    yield from inside.values()


Damage = Callable[[Automaton, list[int], Random], Automaton]
"""Gets an automaton, its initial nodes and a source of chance."""


def wrong_bit(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One bit of one state is flipped."""
    if not automaton.variables:
        return automaton
    number = source.randrange(len(automaton.nodes))
    bit = 1 << source.randrange(len(automaton.variables))
    return _with_node(automaton, number, state=automaton.nodes[number].state ^ bit)


def missing_successor(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One transition is gone."""
    number, before, after = _some_edge(automaton, source)
    return _with_node(automaton, number, successors=(*before, *after))


def extra_successor(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One transition too many."""
    number = _some_edge(automaton, source)[0]
    more = (*automaton.nodes[number].successors, source.randrange(len(automaton.nodes)))
    return _with_node(automaton, number, successors=more)


def other_successor(automaton: Automaton, _starts: list[int], source: Random) -> Automaton:
    """One transition leads elsewhere, if possible to the same inputs and a cycle."""
    number, before, after = _some_edge(automaton, source)
    target = source.choice((number, source.randrange(len(automaton.nodes))))
    return _with_node(automaton, number, successors=(*before, target, *after))


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
    graph = networkx.DiGraph(automaton.edges)
    graph.add_nodes_from(starts)
    kept = sorted({*starts}.union(*(networkx.descendants(graph, start) for start in starts)))
    number = {old: new for new, old in enumerate(kept)}
    nodes = (automaton.nodes[n] for n in kept)
    moved = (replace(n, successors=tuple(number[to] for to in n.successors)) for n in nodes)
    return replace(automaton, nodes=tuple(moved))


def _some_edge(
    automaton: Automaton, source: Random
) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
    """A node, and its successors before and after a random one."""
    number = source.choice([i for i, node in enumerate(automaton.nodes) if node.successors])
    successors = automaton.nodes[number].successors
    at = source.randrange(len(successors))
    return number, successors[:at], successors[at + 1 :]


def _with_node(automaton: Automaton, number: int, **changes: object) -> Automaton:
    nodes = [*automaton.nodes]
    nodes[number] = replace(nodes[number], **changes)
    return replace(automaton, nodes=tuple(nodes))
