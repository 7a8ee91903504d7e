"""Explicit strategies and counterstrategies: nodes, their JSON text, and back.

The text is byte for byte what SLUGS prints, as far as published outputs show it.
"""

import json
from dataclasses import dataclass
from typing import Any

from oracle.specification import Specification


@dataclass(frozen=True)
class Node:
    """A state (as a number, see truth.py), the memory, and the ids of the successors."""

    state: int
    rank: int
    successors: tuple[int, ...]


@dataclass(frozen=True)
class Automaton:
    variables: tuple[str, ...]  # as declared
    nodes: tuple[Node, ...]


class MalformedAutomatonError(Exception):
    """The text is not an automaton over the variables of the specification."""


def to_json(specification: Specification, automaton: Automaton) -> str:
    """The JSON that `--explicitStrategy --jsonOutput` prints."""
    nodes = ",\n\n".join(
        f'"{number}": {{\n\t"rank": {node.rank},\n'
        f'\t"state": [{_joined(printed_state(specification, node.state))}],\n'
        f'\t"trans": [{_joined(node.successors)}]\n}}'
        for number, node in enumerate(automaton.nodes)
    )
    end = "\n\n" if automaton.nodes else ""
    variables = ", ".join(f'"{name}"' for name in automaton.variables)
    return (
        f'{{"version": 0,\n "slugs": "0.0.1",\n\n "variables": [{variables}],\n\n'
        f' "nodes": {{\n{nodes}{end}}}}}\n'
    )


def to_text(specification: Specification, automaton: Automaton) -> str:
    """The text form that `--explicitStrategy` prints alone."""
    lines = []
    for number, node in enumerate(automaton.nodes):
        bits = printed_state(specification, node.state)
        values = ", ".join(
            f"{name}:{bit}" for name, bit in zip(automaton.variables, bits, strict=True)
        )
        lines.append(f"State {number} with rank {node.rank} -> <{values}>\n")
        lines.append(f"\tWith successors : {_joined(node.successors)}\n")
    return "".join(lines)


def from_json(specification: Specification, text: str) -> Automaton:
    """Read an automaton back."""
    try:
        data = json.loads(text)
        variables = tuple(data["variables"])
        if variables != specification.bits:
            raise MalformedAutomatonError(f"variables are {variables}")
        nodes = data["nodes"]
        parsed = tuple(
            _parse_node(specification, nodes[str(number)], len(nodes))
            for number in range(len(nodes))
        )
    except (ValueError, KeyError, TypeError) as error:
        raise MalformedAutomatonError(repr(error)) from error
    return Automaton(variables, parsed)


def printed_state(specification: Specification, state: int) -> list[int]:
    """The bits of a state in the order in which a strategy prints them."""
    count = len(specification.bits)
    return [state >> (count - 1 - i) & 1 for i in range(count)]


def _parse_node(specification: Specification, node: dict[str, Any], count: int) -> Node:
    bits = specification.bits
    value = dict(zip(bits, node["state"], strict=True))
    if not set(value.values()) <= {0, 1}:
        raise MalformedAutomatonError(f"state {node['state']} has other values than 0 and 1")
    successors = tuple(int(successor) for successor in node["trans"])
    if not all(0 <= successor < count for successor in successors):
        raise MalformedAutomatonError(f"successors {successors} of {count} nodes")
    state = sum(value[bit] << (len(bits) - 1 - i) for i, bit in enumerate(bits))
    return Node(state, int(node["rank"]), successors)


def _joined(numbers: list[int] | tuple[int, ...]) -> str:
    return ", ".join(map(str, numbers))
