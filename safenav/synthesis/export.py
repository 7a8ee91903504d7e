"""A strategy for other tools: a networkx graph, GraphML, DOT, and its size in figures.

Values are written in words (``region=47 heading=east scout``), nodes and edges come in the
order of the automaton: the same strategy always gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from safenav.spec.specification import Owner, Section, Specification, Variable
from safenav.synthesis.request import SynthesisResult
from safenav.synthesis.strategy import Strategy, bit_names
from safenav.world.map import Heading

if TYPE_CHECKING:
    import networkx

_NOT_XML = "[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"  # compiled on use: that is slow


def to_dot(strategy: Strategy) -> str:
    """Return the automaton in Graphviz's language. Initial nodes have a double border."""
    spec = strategy.specification
    initial = frozenset(strategy.initial())
    lines = [f"digraph {_quoted(spec.robot)} {{", f"  label={_quoted(spec.title)};"]
    lines += ["  rankdir=LR;", "  node [shape=box, style=rounded];"]
    for node, values in _decoded(strategy):
        label = f"{node}: goal {strategy.ranks[node]}"
        for owner in (Owner.OUTPUT, Owner.INPUT):
            words = in_words(strategy, values, owner)
            label += f"\n{words}" if words else ""
        border = ", peripheries=2" if node in initial else ""
        lines.append(f"  {node} [label={_quoted(label)}{border}];")
    for node, successors in enumerate(strategy.transitions):
        lines += [f"  {node} -> {successor};" for successor in successors]
    return "\n".join(lines) + "\n}\n"


def to_graphml(strategy: Strategy) -> str:
    """Return the automaton as GraphML, with every variable as a number on the nodes."""
    import networkx

    return "\n".join(networkx.generate_graphml(to_networkx(strategy))) + "\n"


def to_networkx(strategy: Strategy) -> networkx.DiGraph[int]:
    """Return the automaton as a directed graph. Nodes carry ``label``, ``goal``, ``initial`` and a
    number for each variable (``value_`` before its name), edges their ``inputs``."""
    # Imported here: it takes longer than most syntheses.
    import networkx

    spec = strategy.specification
    initial = frozenset(strategy.initial())
    graph: networkx.DiGraph[int] = networkx.DiGraph()
    graph.graph["robot"] = spec.robot
    graph.graph["title"] = re.sub(_NOT_XML, "?", spec.title)
    inputs = []
    for node, values in _decoded(strategy):
        words = [in_words(strategy, values, owner) for owner in (Owner.OUTPUT, Owner.INPUT)]
        inputs.append(words[1])
        graph.add_node(
            node,
            label=" ".join(filter(None, words)),
            goal=strategy.ranks[node],
            initial=node in initial,
            **{f"value_{name}": value for name, value in values.items()},
        )
    for node, successors in enumerate(strategy.transitions):
        for successor in successors:
            graph.add_edge(node, successor, inputs=inputs[successor])
    return graph


def in_words(strategy: Strategy, values: Mapping[str, int], owner: Owner) -> str:
    """Return the values of the inputs or of the outputs in words."""
    owned = strategy.specification.owned(owner)
    return " ".join(_value_in_words(variable, values[variable.name]) for variable in owned)


def size_of(spec: Specification, result: SynthesisResult) -> dict[str, Any]:
    """Return the figures of one synthesis as data: ``goals`` of the specification, ``bits`` of a
    state, ``seconds`` that the synthesizer took; None where there is no strategy."""
    strategy = result.strategy
    return {
        "verdict": result.verdict.value,
        "states": None if strategy is None else len(strategy.states),
        "edges": None if strategy is None else strategy.edges,
        "goals": max(1, len(spec.section(Section.SYS_LIVENESS))),
        "variables": len(spec.variables),
        "bits": sum(len(bit_names(variable)) for variable in spec.variables),
        "seconds": result.seconds,
    }


def _value_in_words(variable: Variable, value: int) -> str:
    if variable.bounds is None:
        return variable.name if value else f"!{variable.name}"
    if variable.bounds == (0, len(Heading) - 1) and variable.name.endswith("heading"):
        return f"{variable.name}={Heading(value).label}"
    return f"{variable.name}={value}"


def _decoded(strategy: Strategy) -> Iterator[tuple[int, dict[str, int]]]:
    return ((node, strategy.values(node)) for node in range(len(strategy.states)))


def _quoted(text: str) -> str:
    escaped = (
        re.sub(_NOT_XML, "?", text).replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    )
    return f'"{escaped}"'
