"""An automaton and its specification, prepared for both kinds of check.

Only the nodes reachable from the given start nodes are visited, in breadth-first order, so the
first fault found is also one of the nearest.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cached_property, lru_cache
from itertools import chain, compress, repeat

from msgspec import Struct

from safenav.components import components, path_to, shortest_paths
from safenav.data import cached_method
from safenav.errors import Diagnostic, InputError
from safenav.formula.parser import FormulaError, parse
from safenav.formula.syntax import Formula
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.strategy import Field, Strategy, in_words
from safenav.verify.completions import Clause, Evaluator, Row, Slot, Vector, add, first_row


class Fault(StrEnum):
    """Defects of an automaton; the value is the wording."""

    NO_START = "no node to start from"
    RANGE = "a value outside its range"
    FORBIDDEN_INPUT = "a next input that the assumptions exclude"
    SEVERAL_INPUTS = "the environment does not choose one next input"
    MISSING_SUCCESSOR = "no successor for an allowed move of the other player"
    SEVERAL_SUCCESSORS = "two successors for the same move of the other player"
    BROKEN_GUARANTEE = "a transition that breaks a guarantee"
    STARVED_GOAL = "a cycle that meets all assumptions, but not this goal"
    STARVED_ASSUMPTION = "a cycle on which the environment does not meet this assumption"
    GOALS_MET = "a cycle on which the system meets all its goals"


class Failure(Struct, frozen=True):
    """A fault, and a path to it.

    ``node``: its node, None if it concerns no node; ``state``: that node in words. ``successor``:
    the other end of a wrong transition. ``constraint``: the violated constraint, with its origin.
    ``path``: a shortest one from an initial node to ``node``. ``cycle``: nodes of a closed walk
    from ``node``, for faults of liveness. ``detail``: the move in question.
    """

    fault: Fault
    node: int | None = None
    successor: int | None = None
    constraint: Constraint | None = None
    path: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()
    state: str = ""
    detail: str = ""

    @property
    def lines(self) -> list[str]:
        """The fault, and the constraint that it breaks with its origin."""
        where = "" if self.node is None else f" at node {self.node} ({self.state})"
        found = [f"{self.fault.value}{where}", *([self.detail] if self.detail else [])]
        if self.constraint is not None:
            found.append(f"constraint: [{self.constraint.section}] {self.constraint.formula}")
            found.append(f"from: {self.constraint.origin}")
        return found


class Verification(Struct, frozen=True):
    """Result of a check. ``failures``: the shallowest one of each kind and constraint; ``nodes``,
    ``edges``: how many were reached and checked. ``vacuous``: no initial state satisfies the
    assumptions, so the strategy guarantees nothing."""

    failures: tuple[Failure, ...]
    nodes: int
    edges: int
    vacuous: bool = False

    @property
    def ok(self) -> bool:
        return not self.failures


_BLOCK_EDGES = 1 << 16
_DIGITS = bytes.maketrans(b"\x00\x01", b"01")

_parse = lru_cache(maxsize=1 << 15)(parse)

Alive = Callable[[], None]


def quiet() -> None:
    """Ignore a check's report that it is still running."""


Against = list[tuple[Clause, int]]
"""Clauses, each with the plane of the edges that do not satisfy it."""
_OF_MOVES = (Section.ENV_TRANS, Section.SYS_TRANS, Section.ENV_LIVENESS, Section.SYS_LIVENESS)


class Automaton:
    """The part of ``strategy`` that is reachable from ``starts``. ``alive`` is called regularly
    during long computations; it may raise."""

    def __init__(
        self,
        spec: Specification,
        strategy: Strategy,
        starts: Sequence[int],
        alive: Alive = quiet,
    ) -> None:
        self.alive = alive
        self.spec = spec
        self.strategy = strategy
        self.starts = tuple(starts)
        self.current = tuple(Slot(v, False) for v in spec.variables)
        self.next_inputs = tuple(Slot(v, True) for v in spec.owned(Owner.INPUT))
        self.next_outputs = tuple(Slot(v, True) for v in spec.owned(Owner.OUTPUT))
        self._before = shortest_paths(self.starts, strategy.transitions.__getitem__)
        self.nodes = list(self._before)
        self.edges = Edges(self.nodes, strategy.transitions)

    def clauses(self, section: Section) -> list[Clause]:
        return clauses(self.spec, section)

    def places(self, owner: Owner) -> list[Slot]:
        """Return the inputs or the outputs now."""
        return [place for place in self.current if place.variable.owner is owner]

    def begun(self, owner: Owner) -> set[Row]:
        """Return the inputs or the outputs with which it may begin."""
        return {self.parts(owner)[node] for node in self.starts}

    def against(self) -> list[Against]:
        """Return the clauses of ENV_TRANS, SYS_TRANS, ENV_LIVENESS and SYS_LIVENESS, each with the
        plane of the edges that do not satisfy it."""
        parts = [self.clauses(section) for section in _OF_MOVES]
        planes = iter(self.violated([clause.formula for part in parts for clause in part]))
        return [[(clause, next(planes)) for clause in part] for part in parts]

    def edge_failures(self, assumed: Against, promised: Against) -> Iterator[Failure]:
        """Yield the first edge that violates each assumption or guarantee on transitions."""
        faults = ((Fault.FORBIDDEN_INPUT, assumed), (Fault.BROKEN_GUARANTEE, promised))
        for fault, against in faults:
            for clause, wrong in against:
                if wrong:
                    source, target = self.edges[first_row(wrong)]
                    yield self.failure(fault, source, successor=target, clause=clause)

    def cycle_failures(
        self, fault: Fault, allowed: int, unmet: Sequence[int], clause: Clause | None = None
    ) -> Iterator[Failure]:
        """Yield a cycle of the ``allowed`` edges on which each condition is met (see
        ``fair_cycle``), if there is one."""
        self.alive()
        cycle = fair_cycle(self.edges, allowed, unmet)
        if cycle is not None:
            yield self.failure(fault, cycle[0], clause=clause, cycle=cycle)

    @cached_property
    def values(self) -> dict[int, Row]:
        """All variables of each node, in the specification's order."""
        fields = [self._fields[variable.name] for variable in self.spec.variables]
        states = self.strategy.states
        return {n: tuple([field.decode(states[n]) for field in fields]) for n in self.nodes}

    @cached_method
    def parts(self, owner: Owner) -> dict[int, Row]:
        """Return the inputs or the outputs of each node, in the specification's order."""
        own = [k for k, v in enumerate(self.spec.variables) if v.owner is owner]
        return {node: tuple([row[k] for k in own]) for node, row in self.values.items()}

    def violated(self, formulas: Sequence[Formula]) -> list[int]:
        """Return for each formula the plane of the edges that violate it."""
        found = [0] * len(formulas)
        for start in range(0, len(self.edges), _BLOCK_EDGES):
            self.alive()
            evaluator = self._evaluator(slice(start, start + _BLOCK_EDGES))
            for k, formula in enumerate(formulas):
                wrong = evaluator.everywhere ^ evaluator.holds(formula)
                if wrong:
                    found[k] |= wrong << start
        return found

    def range_failures(self) -> Iterator[Failure]:
        """Yield the first value outside its range, for each integer variable."""
        for k, place in enumerate(self.current):
            allowed = place.variable.range
            pairs = ((node, row[k]) for node, row in self.values.items())
            if wrong := next((pair for pair in pairs if pair[1] not in allowed), None):
                detail = f"{place.variable.declaration}, found {wrong[1]}"
                yield self.failure(Fault.RANGE, wrong[0], detail=detail)

    def failure(
        self,
        fault: Fault,
        node: int,
        *,
        successor: int | None = None,
        clause: Clause | None = None,
        cycle: tuple[int, ...] = (),
        detail: str = "",
    ) -> Failure:
        return Failure(
            fault=fault,
            node=node,
            successor=successor,
            constraint=clause.constraint if clause else None,
            path=self.path(node),
            cycle=cycle,
            state=self.in_words(node),
            detail=detail or ("" if successor is None else f"to {self.in_words(successor)}"),
        )

    def path(self, node: int) -> tuple[int, ...]:
        """Return a shortest path from a start node."""
        return path_to(node, self._before)

    def in_words(self, node: int) -> str:
        values = self.strategy.values(node)
        words = [in_words(self.strategy, values, o) for o in (Owner.OUTPUT, Owner.INPUT)]
        return " ".join(filter(None, words))

    def move_in_words(self, places: Sequence[Slot], row: Row) -> str:
        """Return a valuation of inputs or of outputs in words."""
        if not places:
            return "nothing to choose"
        values = {p.variable.name: v for p, v in zip(places, row, strict=True)}
        return in_words(self.strategy, values, places[0].variable.owner)

    def _evaluator(self, block: slice) -> Evaluator:
        """Return the evaluator of formulas on some of the edges."""
        width = len(self.strategy.states[0])
        sources, targets = self.edges.sources[block], self.edges.targets[block]
        ends = [b"".join(map(self._digits.__getitem__, end)) for end in (sources, targets)]

        def lookup(name: str, primed: bool) -> Vector:
            field = self._fields[name]
            digits = ends[primed]
            last = len(digits) - width
            # The digits of one column from the last edge to the first, read as a number.
            raw = [int(digits[last + column :: -width], 2) for column in field.columns]
            if field.variable.bounds is None:
                return raw
            return add(raw, evaluator.constant(field.base))

        evaluator = Evaluator(len(sources), lookup)
        return evaluator

    @cached_property
    def _fields(self) -> dict[str, Field]:
        return {field.variable.name: field for field in self.strategy.fields}

    @cached_property
    def _digits(self) -> dict[int, bytes]:
        """The state of each node as text, a digit for each bit."""
        states = self.strategy.states
        return {node: bytes(states[node]).translate(_DIGITS) for node in self.nodes}


def clauses(spec: Specification, section: Section) -> list[Clause]:
    """Return the parsed constraints of a section.

    Raises InputError for a constraint that cannot be read or names an undeclared variable.
    """
    declared = {variable.name for variable in spec.variables}
    found = []
    for constraint in spec.section(section):
        try:
            clause = Clause(constraint, _parse(constraint.formula))
        except FormulaError as error:
            raise _unreadable(constraint, error.column, error.found, error.hint) from error
        unknown = sorted({name for name, _ in clause.places} - declared)
        if unknown:
            raise _unreadable(constraint, 1, f"'{unknown[0]}' is not declared", "")
        found.append(clause)
    return found


def _unreadable(constraint: Constraint, column: int, found: str, hint: str) -> InputError:
    file, _, line = constraint.origin.item.rpartition(":")
    if line.isdecimal():  # a line of a specification file
        return InputError([Diagnostic(file, int(line), column, found, hint, constraint.formula)])
    place = f"{constraint.origin.item}: [{constraint.section}] {constraint.formula}"
    return InputError([Diagnostic(place, 1, column, found, hint)])


Edge = tuple[int, int]

_BITS = bytes.maketrans(b"01", b"\x00\x01")


class Edges:
    """The edges out of ``nodes``, in their order; ``transitions`` has the successors of each node.
    There may be millions, so their ends are two flat lists, and pairs are made on demand."""

    def __init__(self, nodes: Sequence[int], transitions: Sequence[Sequence[int]]) -> None:
        self._nodes = nodes
        self._successors = [transitions[node] for node in nodes]
        lengths = map(len, self._successors)
        self.sources = list(chain.from_iterable(map(repeat, nodes, lengths)))
        self.targets = list(chain.from_iterable(self._successors))

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, index: int) -> Edge:
        return self.sources[index], self.targets[index]

    def __iter__(self) -> Iterator[Edge]:
        return zip(self.sources, self.targets, strict=True)

    def by_node(self) -> Iterator[tuple[int, Sequence[int], int]]:
        """Yield each node with its successors and the index of its first edge."""
        first = 0
        for node, targets in zip(self._nodes, self._successors, strict=True):
            yield node, targets, first
            first += len(targets)

    def flags(self, plane: int) -> bytes:
        """Return for each edge 1 if it is in the set, else 0."""
        return f"{plane:0{len(self)}b}".encode().translate(_BITS)[::-1]


def cyclic_parts(edges: Iterable[Edge]) -> dict[int, int]:
    """Return the nodes that lie on a cycle of ``edges``, each with the number of its component."""
    successors = _successors(edges)
    indegree = Counter(chain.from_iterable(successors.values()))
    ready = [node for node in successors if node not in indegree]
    while ready:  # no cycle leads there; usually removes all nodes, cheaply
        for target in successors.pop(ready.pop(), ()):
            indegree[target] -= 1
            if not indegree[target]:
                ready.append(target)
    nodes = list(successors)
    index = {node: place for place, node in enumerate(nodes)}
    graph = [[index[target] for target in successors[node] if target in index] for node in nodes]
    return {
        nodes[place]: number
        for number, component in enumerate(components(graph))
        for place in component
        if len(component) > 1 or place in graph[place]
    }


def _successors(edges: Iterable[Edge]) -> dict[int, list[int]]:
    successors: dict[int, list[int]] = {}
    for source, target in edges:
        successors.setdefault(source, []).append(target)
    return successors


def closed_walk(edges: Iterable[Edge], required: Sequence[Edge]) -> tuple[int, ...]:
    """Return a walk over ``edges`` of one component that takes each ``required`` edge and returns
    to its first node (which is not repeated at the end)."""
    successors = _successors(edges)
    if not required:
        source = next(iter(successors))
        required = [(source, successors[source][0])]
    walk = [required[0][0]]
    for source, target in (*required, required[0]):
        paths = shortest_paths(walk[-1:], lambda node: successors.get(node, ()))
        walk += (*path_to(source, paths)[1:], target)
    return tuple(walk[:-2])


def fair_cycle(edges: Edges, allowed: int, unmet: Sequence[int]) -> tuple[int, ...] | None:
    """Return a closed walk over the ``allowed`` edges on which each condition is met by some edge;
    None if there is none. ``unmet``: for each condition, the edges that do not meet it. All these
    sets are planes (``Evaluator``)."""
    rows = [*compress(range(len(edges)), edges.flags(allowed))]
    parts = cyclic_parts(edges[row] for row in rows)
    inside: dict[int, list[int]] = {}
    for row in rows:
        part = parts.get(edges.sources[row])
        if part is not None and part == parts.get(edges.targets[row]):
            inside.setdefault(part, []).append(row)
    met = [edges.flags(((1 << len(edges)) - 1) ^ plane) for plane in unmet] if inside else []
    for walked in inside.values():
        required = [next((row for row in walked if flags[row]), None) for flags in met]
        if None not in required:
            return closed_walk(
                [edges[row] for row in walked], [edges[row] for row in required if row is not None]
            )
    return None
