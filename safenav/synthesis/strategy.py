"""Strategies: finite automata that the synthesizer prints as JSON, also in DOT and GraphML.

A node is a valuation of all variables and a rank (the goal that the strategy pursues there). It has
one successor for each next input that the assumptions allow. The reader checks the shape of the
whole automaton in one pass. The bits of a node become named values only on access, so a million
edges cost a fraction of a second. Files for other tools state values in words (``region=47
heading=east scout``), with nodes and edges in the automaton's order, so a strategy always gives the
same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Annotated

import msgspec
from msgspec import Meta, Struct

from safenav.data import cached_method
from safenav.errors import SynthesizerError
from safenav.formula.syntax import predicate
from safenav.spec.specification import Owner, Section, Specification, Variable, formula_of
from safenav.world.map import Heading

if TYPE_CHECKING:
    import networkx


def bit_names(variable: Variable) -> tuple[str, ...]:
    """Return the synthesizer's names of a variable's bits, least significant first.

    A Boolean is its own bit. An integer stores value - min in the bits that max - min needs:
    ``x@0.min.max``, ``x@1``, ``x@2``, ...; it has no bits if it has only one value.
    """
    if variable.bounds is None:
        return (variable.name,)
    low, high = variable.bounds
    count = (high - low).bit_length()
    return tuple(
        f"{variable.name}@0.{low}.{high}" if bit == 0 else f"{variable.name}@{bit}"
        for bit in range(count)
    )


class Field(Struct, frozen=True):
    """The position of a variable's bits in the state of a node."""

    variable: Variable
    columns: tuple[int, ...]

    @property
    def base(self) -> int:
        """The variable's value if all its bits are zero."""
        return 0 if self.variable.bounds is None else self.variable.bounds[0]

    def decode(self, state: Sequence[int]) -> int:
        value = self.base
        for position, column in enumerate(self.columns):
            if state[column]:
                value += 1 << position
        return value

    def encode(self, value: int) -> tuple[tuple[int, int], ...] | None:
        """Return the pairs (column, bit) of a value; None if the variable cannot have the value."""
        offset = value - self.base
        if not 0 <= offset < 1 << len(self.columns):
            return None
        return tuple((c, offset >> position & 1) for position, c in enumerate(self.columns))


class _Node(Struct):
    rank: Annotated[int, Meta(ge=0)]
    state: list[Annotated[int, Meta(ge=0, le=1)]]
    trans: list[Annotated[int, Meta(ge=0)]]


class _Document(Struct):
    variables: list[str]
    nodes: dict[str, _Node]


class Strategy(Struct, frozen=True, eq=False, dict=True):
    """The automaton of a strategy or counterstrategy, over the variables of a specification.

    ``states``, ``ranks`` and ``transitions`` are its raw columns, with one entry per node, for code
    that reads all nodes. They must not be changed.
    """

    specification: Specification
    fields: tuple[Field, ...]
    states: list[list[int]]
    ranks: list[int]
    transitions: list[list[int]]

    @cached_property
    def _field(self) -> dict[str, Field]:
        return {each.variable.name: each for each in self.fields}

    @classmethod
    def parse(cls, data: bytes, specification: Specification) -> Strategy:
        """Return the automaton printed by ``slugs --explicitStrategy --jsonOutput``.

        Raises SynthesizerError if the text is not such an automaton for the specification.
        """
        try:
            document = msgspec.json.decode(data, type=_Document)
        except msgspec.ValidationError as error:
            raise _malformed(str(error)) from error
        except (msgspec.DecodeError, ValueError, RecursionError) as error:
            raise SynthesizerError(f"the strategy is not JSON: {error}") from error
        fields = locate(document.variables, specification)
        nodes = _in_order(document.nodes)
        states, transitions = [node.state for node in nodes], [node.trans for node in nodes]
        _check_columns(states, transitions, len(document.variables))
        return cls(specification, fields, states, [node.rank for node in nodes], transitions)

    @property
    def edges(self) -> int:
        """The number of transitions."""
        return sum(map(len, self.transitions))

    def values(self, node: int) -> dict[str, int]:
        """Return the values of all variables at a node. A Boolean is 0 or 1."""
        state = self.states[node]
        return {field.variable.name: field.decode(state) for field in self.fields}

    @cached_method
    def initial(self, counter: bool = False) -> tuple[int, ...]:
        """Return the nodes in which a play may start, in ascending order.

        The synthesizer prints them first but does not mark them. They are the leading nodes with
        distinct states that satisfy ENV_INIT and SYS_INIT: in a strategy only those of rank 0; in a
        ``counter``strategy only those with the first node's inputs.
        """
        spec, seen = self.specification, set[tuple[int, ...]]()
        both = (*spec.section(Section.ENV_INIT), *spec.section(Section.SYS_INIT))
        constraints = [predicate(formula_of(constraint)) for constraint in both]
        inputs = [variable.name for variable in spec.owned(Owner.INPUT)]
        first = self.values(0) if self.states else {}
        for node, state in enumerate(self.states):
            values = self.values(node)
            same = all(values[name] == first[name] for name in inputs)
            begins = (same if counter else self.ranks[node] == 0) and tuple(state) not in seen
            if not begins or not all(holds(values, {}) for holds in constraints):
                break
            seen.add(tuple(state))
        return tuple(range(len(seen)))

    def find_initial(self, values: Mapping[str, int]) -> int | None:
        """Return the first initial node with these values of some variables, or None."""
        return next(iter(self.nodes_with(values, self.initial())), None)

    def successors_for(self, node: int, inputs: Mapping[str, int]) -> tuple[int, ...]:
        """Return all successors of a node with the given values of inputs."""
        return self.nodes_with(inputs, self.transitions[node])

    def nodes_with(
        self, values: Mapping[str, int], among: Iterable[int] | None = None
    ) -> tuple[int, ...]:
        """Return the nodes at which these variables have these values; ``among``: the nodes to
        search (default: all)."""
        wanted: list[tuple[int, int]] = []
        for name, value in values.items():
            bits = self._field[name].encode(int(value))
            if bits is None:
                return ()  # outside the variable's range
            wanted += bits
        nodes = range(len(self.states)) if among is None else among
        states = self.states
        return tuple(n for n in nodes if all(states[n][column] == bit for column, bit in wanted))


def _malformed(what: str) -> SynthesizerError:
    return SynthesizerError(f"the strategy is malformed: {what}")


def locate(names: Sequence[str], specification: Specification) -> tuple[Field, ...]:
    """Return the position of each variable's bits among the printed names."""
    known = [*chain.from_iterable(map(bit_names, specification.variables))]
    if sorted(names) != sorted(known):
        wrong = ", ".join(sorted({*names} ^ {*known})) or "a duplicate"
        raise _malformed(f"its variables are not those of the specification: {wrong}")
    column = {name: i for i, name in enumerate(names)}
    return tuple(
        Field(variable, tuple(column[bit] for bit in bit_names(variable)))
        for variable in specification.variables
    )


def _in_order(nodes: Mapping[str, _Node]) -> list[_Node]:
    try:
        return [nodes[str(number)] for number in range(len(nodes))]
    except KeyError as error:
        raise _malformed(f"node {error} is missing among {len(nodes)} nodes") from None


def _check_columns(states: list[list[int]], transitions: list[list[int]], bits: int) -> None:
    """Check all lengths and targets, column by column, since there may be a million edges."""
    for node, state in enumerate(states):
        if len(state) != bits:
            raise _malformed(f"node {node} has {len(state)} bits, expected {bits}")
    if max(chain.from_iterable(transitions), default=-1) >= len(states):
        node = next(n for n, targets in enumerate(transitions) if max(targets) >= len(states))
        raise _malformed(f"node {node} leads to a node that does not exist")


_NOT_XML = "[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"  # compiled on use: that is slow


def to_dot(strategy: Strategy) -> str:
    """Return the automaton in the DOT language. Initial nodes have a double border."""
    spec = strategy.specification
    initial = frozenset(strategy.initial())
    lines = [f"digraph {_quoted(spec.robot)} {{", f"  label={_quoted(spec.title)};"]
    lines += ["  rankdir=LR;", "  node [shape=box, style=rounded];"]
    for node, rank in enumerate(strategy.ranks):
        label, values = f"{node}: goal {rank}", strategy.values(node)
        for owner in (Owner.OUTPUT, Owner.INPUT):
            words = in_words(strategy, values, owner)
            label += f"\n{words}" if words else ""
        border = ", peripheries=2" if node in initial else ""
        lines.append(f"  {node} [label={_quoted(label)}{border}];")
    for node, successors in enumerate(strategy.transitions):
        lines += [f"  {node} -> {successor};" for successor in successors]
    return "\n".join(lines) + "\n}\n"


def to_graphml(strategy: Strategy) -> str:
    """Return the automaton as GraphML. Nodes have every variable as a number."""
    import networkx

    return "\n".join(networkx.generate_graphml(to_networkx(strategy))) + "\n"


def to_networkx(strategy: Strategy) -> networkx.DiGraph[int]:
    """Return the automaton as a directed graph. Nodes have ``label``, ``goal``, ``initial`` and a
    number for each variable (``value_`` before its name); edges have ``inputs``."""
    # Imported here since it takes longer than most syntheses.
    import networkx

    spec = strategy.specification
    initial = frozenset(strategy.initial())
    graph: networkx.DiGraph[int] = networkx.DiGraph()
    graph.graph["robot"] = spec.robot
    graph.graph["title"] = re.sub(_NOT_XML, "?", spec.title)
    inputs = []
    for node, rank in enumerate(strategy.ranks):
        values = strategy.values(node)
        inputs.append(in_words(strategy, values, Owner.INPUT))
        graph.add_node(
            node,
            label=in_words(strategy, values),
            goal=rank,
            initial=node in initial,
            **{f"value_{name}": value for name, value in values.items()},
        )
    for node, successors in enumerate(strategy.transitions):
        for successor in successors:
            graph.add_edge(node, successor, inputs=inputs[successor])
    return graph


def in_words(strategy: Strategy, values: Mapping[str, int], *owners: Owner) -> str:
    """Return, in words, the variables' values of ``owners`` (default: outputs, inputs)."""
    spec = strategy.specification
    variables = (v for owner in owners or (Owner.OUTPUT, Owner.INPUT) for v in spec.owned(owner))
    return " ".join(_value_in_words(variable, values[variable.name]) for variable in variables)


def _value_in_words(variable: Variable, value: int) -> str:
    if variable.bounds is None:
        return variable.name if value else f"!{variable.name}"
    if variable.bounds == (0, len(Heading) - 1) and variable.name.endswith("heading"):
        return f"{variable.name}={Heading(value).label}"
    return f"{variable.name}={value}"


def _quoted(text: str) -> str:
    escaped = (
        re.sub(_NOT_XML, "?", text).replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    )
    return f'"{escaped}"'
