"""Model checks explicit strategies and counterstrategies: a graph, and its cycles.

Knows the specification only through the explicit game and shares nothing with the fixpoints.
Every node is taken as reachable.  The result is a list of complaints, empty for a sound automaton.
"""

from collections.abc import Iterable

import networkx

from oracle.automaton import Automaton, Node
from oracle.game import Game, StateSet, members

Edge = tuple[int, int]
Complaints = list[str]


def check_strategy(game: Game, automaton: Automaton, robotics_init: bool = False) -> Complaints:
    """What is wrong with a strategy of the system."""
    nodes = automaton.nodes
    complaints = _missing_starts(game, nodes, robotics_init)
    for number, node in enumerate(nodes):
        complaints += _wrong_answers(game, nodes, number, node)
    edges = _edges(nodes)
    for j in range(len(game.guarantees)):
        starving = [e for e in edges if not _meets(game.guarantees[j], nodes, e)]
        for component in components(starving):
            if all(_some(assumption, nodes, component) for assumption in game.assumptions):
                complaints.append(f"nodes {_ends(component)} starve guarantee {j}")
    return complaints


def check_counterstrategy(
    game: Game, automaton: Automaton, robotics_init: bool = False
) -> Complaints:
    """What is wrong with a strategy of the environment."""
    nodes = automaton.nodes
    complaints = _missing_losing_starts(game, nodes, robotics_init)
    for number, node in enumerate(nodes):
        complaints += _wrong_move(game, nodes, number, node)
    edges = _edges(nodes)
    for component in components(edges):
        if all(_some(guarantee, nodes, component) for guarantee in game.guarantees):
            complaints.append(f"nodes {_ends(component)} can satisfy all guarantees")
    for i in range(len(game.assumptions)):
        starving = [e for e in edges if not _meets(game.assumptions[i], nodes, e)]
        for component in components(starving):
            complaints.append(f"nodes {_ends(component)} starve assumption {i}")
    return complaints


def _missing_starts(game: Game, nodes: tuple[Node, ...], robotics_init: bool) -> Complaints:
    legal = game.env_init & game.sys_init
    starts = _states(nodes) & legal
    if robotics_init:
        return [f"legal start {s} is missing" for s in members(legal & ~starts)]
    return [
        f"no start for inputs of {members(inputs)}"
        for inputs in game.input_classes
        if inputs & game.env_init and not inputs & starts
    ]


def _wrong_answers(game: Game, nodes: tuple[Node, ...], number: int, node: Node) -> Complaints:
    complaints = []
    unanswered = dict(game.moves[node.state])
    for successor in node.successors:
        state = nodes[successor].state
        inputs = game.input_class_of[state]
        if inputs not in game.moves[node.state]:
            complaints.append(f"edge {number} -> {successor} breaks ENV_TRANS")
        elif inputs not in unanswered:
            complaints.append(f"edge {number} -> {successor} is a second answer")
        elif not unanswered.pop(inputs) >> state & 1:
            complaints.append(f"edge {number} -> {successor} breaks SYS_TRANS")
    complaints += [
        f"node {number} has no answer to inputs of {members(inputs)}" for inputs in unanswered
    ]
    return complaints


def _missing_losing_starts(game: Game, nodes: tuple[Node, ...], robotics_init: bool) -> Complaints:
    """One play that starts well for the environment is enough: it chooses the first inputs."""
    states = _states(nodes)
    if robotics_init:
        if states & game.env_init & game.sys_init:
            return []
        return ["no legal start"]
    for inputs in game.input_classes:
        if inputs & game.env_init and not inputs & game.env_init & game.sys_init & ~states:
            return []
    return ["for no initial input are all initial outputs covered"]


def _wrong_move(game: Game, nodes: tuple[Node, ...], number: int, node: Node) -> Complaints:
    moves = game.moves[node.state]
    states = [nodes[successor].state for successor in node.successors]
    if not states:
        return [] if 0 in moves.values() else [f"node {number} leaves the system a way out"]
    inputs = game.input_class_of[states[0]]
    if inputs not in moves:
        return [f"node {number} moves against ENV_TRANS"]
    if len(set(states)) != len(states):
        return [f"node {number} covers an output twice"]
    if sum(1 << state for state in states) != moves[inputs]:
        return [f"node {number} does not cover exactly the outputs that SYS_TRANS allows"]
    return []


def _states(nodes: Iterable[Node]) -> StateSet:
    result = 0
    for node in nodes:
        result |= 1 << node.state
    return result


def _edges(nodes: tuple[Node, ...]) -> list[Edge]:
    return [(number, s) for number, node in enumerate(nodes) for s in node.successors]


def _meets(goal: tuple[StateSet, ...], nodes: tuple[Node, ...], edge: Edge) -> bool:
    return bool(goal[nodes[edge[0]].state] >> nodes[edge[1]].state & 1)


def _some(goal: tuple[StateSet, ...], nodes: tuple[Node, ...], edges: list[Edge]) -> bool:
    return any(_meets(goal, nodes, edge) for edge in edges)


def _ends(edges: list[Edge]) -> list[int]:
    return sorted({source for source, _ in edges})


def components(edges: list[Edge]) -> list[list[Edge]]:
    """The strongly connected components that hold a cycle, each as its edges."""
    parts = enumerate(networkx.strongly_connected_components(networkx.DiGraph(edges)))
    number = {node: k for k, part in parts for node in part}
    inside: dict[int, list[Edge]] = {}
    for source, target in edges:
        if number[source] == number[target]:
            inside.setdefault(number[source], []).append((source, target))
    return list(inside.values())
