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


@dataclass
class Node:
    """A state (as a number, see game.py), the memory, and the ids of the successors."""

    state: int
    rank: int
    successors: list[int]


@dataclass
class Automaton:
    variables: tuple[str, ...]  # bits, as declared
    nodes: list[Node]

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
        f'\t"state": {automaton.bits(node)},\n\t"trans": {node.successors}\n}}'
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
    pairs = zip(states, found, strict=True)
    read = [Node(int(bits or "0", 2), int(node["rank"]), node["trans"]) for bits, node in pairs]
    return Automaton(names, read)


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


def _meets(game: Game, goal: np.ndarray, nodes: list[Node], edge: Edge) -> bool:
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


Damage = Callable[[Automaton, Random], object]
"""Changes an automaton in one way, by chance."""


def wrong_bit(automaton: Automaton, source: Random) -> None:
    """One bit of one state is flipped."""
    if automaton.variables:
        node = source.choice(automaton.nodes)
        node.state ^= 1 << source.randrange(len(automaton.variables))


def missing_successor(automaton: Automaton, source: Random) -> None:
    """One transition is gone."""
    node = _some_node(automaton, source)
    del node.successors[source.randrange(len(node.successors))]


def extra_successor(automaton: Automaton, source: Random) -> None:
    """One transition too many."""
    _some_node(automaton, source).successors.append(source.randrange(len(automaton.nodes)))


def other_successor(automaton: Automaton, source: Random) -> None:
    """One transition leads elsewhere, if possible to the same inputs and a cycle."""
    node = _some_node(automaton, source)
    targets = (automaton.nodes.index(node), source.randrange(len(automaton.nodes)))
    node.successors[source.randrange(len(node.successors))] = source.choice(targets)


def no_memory(automaton: Automaton, source: Random) -> None:
    """Transitions keep their state and may forget which goal they were for: goals may starve."""
    twins: dict[int, list[int]] = {}
    for number, node in enumerate(automaton.nodes):
        twins.setdefault(node.state, []).append(number)
    for node in automaton.nodes:
        states = [automaton.nodes[to].state for to in node.successors]
        node.successors = [source.choice(twins[state]) for state in states]


def missing_start(automaton: Automaton, _source: Random) -> None:
    """Node 0 is gone, and with it every transition to it."""
    del automaton.nodes[0]
    for node in automaton.nodes:
        node.successors = [to - 1 for to in node.successors if to > 0]


DAMAGES: tuple[Damage, ...] = (
    wrong_bit,
    missing_successor,
    extra_successor,
    other_successor,
    no_memory,
    missing_start,
)


def damaged(automaton: Automaton, damage: Damage, starts: list[int], source: Random) -> Automaton:
    """A damaged copy of an automaton with these initial nodes."""
    nodes = [replace(node, successors=[*node.successors]) for node in automaton.nodes]
    copy = replace(automaton, nodes=nodes)
    damage(copy, source)
    return without_unreachable(copy, starts) if damage is no_memory else copy


def _some_node(automaton: Automaton, source: Random) -> Node:
    return source.choice([node for node in automaton.nodes if node.successors])


def without_unreachable(automaton: Automaton, starts: list[int]) -> Automaton:
    reached, latest = {*starts}, {*starts}
    while latest := {to for one in latest for to in automaton.nodes[one].successors} - reached:
        reached |= latest
    kept = sorted(reached)
    number = {old: new for new, old in enumerate(kept)}
    nodes = (automaton.nodes[n] for n in kept)
    moved = [replace(n, successors=[number[to] for to in n.successors]) for n in nodes]
    return replace(automaton, nodes=moved)
