"""An automaton and its specification: reachable nodes and edges, and cycles.

Only nodes reachable from the given start nodes are visited, in breadth-first order, so the first
found fault is one of the nearest to the start.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import chain, compress, repeat
from operator import not_
from typing import Any

from safenav.components import components, path_to, reached
from safenav.data import cached_method
from safenav.formula.syntax import Formula
from safenav.spec.specification import Owner, Section, Specification, formula_of, unreadable
from safenav.synthesis.strategy import Strategy
from safenav.verify.completions import Clause, Completions, Evaluator, Row, Slot, Vector, add, flags

_BLOCK_EDGES = 1 << 16
_DIGITS = bytes.maketrans(b"\x00\x01", b"01")

_clause = lru_cache(maxsize=1 << 15)(lambda each: Clause(each, formula_of(each)))


def clauses(spec: Specification, section: Section) -> list[Clause]:
    """Return the parsed constraints of a section.

    Raises InputError for a constraint that cannot be read or names an undeclared variable.
    """
    declared = {variable.name for variable in spec.variables}
    found = [_clause(constraint) for constraint in spec.section(section)]
    for clause in found:
        if unknown := sorted({name for name, _ in clause.places} - declared):
            raise unreadable(clause.constraint, f"'{unknown[0]}' is not declared")
    return found


def openings(spec: Specification) -> tuple[Completions, Completions]:
    """Return two sets of valuations: initial inputs that the assumptions allow, and outputs that
    the guarantees then allow."""
    inputs, outputs = ([Slot(variable, False) for variable in spec.owned(o)] for o in Owner)
    assumed, promised = clauses(spec, Section.ENV_INIT), clauses(spec, Section.SYS_INIT)
    return Completions((), inputs, assumed), Completions(inputs, outputs, promised)


def rounds(spec: Specification) -> tuple[Completions, Completions]:
    """Return two sets of valuations after a state: next inputs that the assumptions allow, and next
    outputs that the guarantees then allow."""
    now = [Slot(variable, False) for variable in spec.variables]
    inputs, outputs = ([Slot(variable, True) for variable in spec.owned(o)] for o in Owner)
    assumed, promised = clauses(spec, Section.ENV_TRANS), clauses(spec, Section.SYS_TRANS)
    return Completions(now, inputs, assumed), Completions([*now, *inputs], outputs, promised)


Edge = tuple[int, int]
Against = list[tuple[Clause, int]]
"""Clauses, each with the plane (a bit per edge) of the edges that violate it."""
_OF_MOVES = (Section.ENV_TRANS, Section.SYS_TRANS, Section.ENV_LIVENESS, Section.SYS_LIVENESS)


class Automaton:
    """The part of ``strategy`` that is reachable from ``starts``."""

    def __init__(self, spec: Specification, strategy: Strategy, starts: Sequence[int]) -> None:
        self.spec, self.strategy, self.starts = spec, strategy, tuple(starts)
        self._before = reached(self.starts, strategy.transitions.__getitem__)
        self.nodes = list(self._before)
        self.edges = Edges({node: strategy.transitions[node] for node in self.nodes})
        self._fields = {field.variable.name: field for field in strategy.fields}

    @cached_property
    def against(self) -> list[Against]:
        """The clauses of ENV_TRANS, SYS_TRANS, ENV_LIVENESS and SYS_LIVENESS, as four lists. Each
        clause has the plane (bit mask) of the edges that violate it."""
        parts = [clauses(self.spec, section) for section in _OF_MOVES]
        planes = iter(self.violated([clause.formula for part in parts for clause in part]))
        return [[(clause, next(planes)) for clause in part] for part in parts]

    @cached_property
    def values(self) -> dict[int, Row]:
        """The values of all variables at each node, in the specification's order."""
        fields = [self._fields[variable.name] for variable in self.spec.variables]
        states = self.strategy.states
        return {n: tuple([field.decode(states[n]) for field in fields]) for n in self.nodes}

    @cached_method
    def parts(self, owner: Owner) -> dict[int, Row]:
        """Return the values of the inputs or of the outputs at each node."""
        own = [k for k, v in enumerate(self.spec.variables) if v.owner is owner]
        return {node: tuple([row[k] for k in own]) for node, row in self.values.items()}

    def violated(self, formulas: Sequence[Formula]) -> list[int]:
        """Return, for each formula, the plane (bit mask) of the edges that violate it."""
        found = [0] * len(formulas)
        for start in range(0, len(self.edges), _BLOCK_EDGES):
            evaluator = self._evaluator(slice(start, start + _BLOCK_EDGES))
            for k, formula in enumerate(formulas):
                wrong = evaluator.everywhere ^ evaluator.holds(formula)
                if wrong:
                    found[k] |= wrong << start
        return found

    def path(self, node: int) -> tuple[int, ...]:
        """Return a shortest path from a start node to ``node``."""
        return path_to(node, self._before)

    def _evaluator(self, block: slice) -> Evaluator:
        """Return an evaluator of formulas on some of the edges, one edge per row."""
        width = len(self.strategy.states[0])
        blocks = [end[block] for end in self.edges.ends]
        ends = [b"".join(map(self._digits.__getitem__, end)) for end in blocks]

        def lookup(name: str, primed: bool) -> Vector:
            field = self._fields[name]
            digits = ends[primed]
            last = len(digits) - width
            # The digits of one column, from the last edge to the first, form a number.
            raw = [int(digits[last + column :: -width], 2) for column in field.columns]
            if field.variable.bounds is None:
                return raw
            return add(raw, evaluator.constant(field.base))

        evaluator = Evaluator(len(blocks[0]), lookup)
        return evaluator

    @cached_property
    def _digits(self) -> dict[int, bytes]:
        """The state of each node as text, a digit for each bit."""
        states = self.strategy.states
        return {node: bytes(states[node]).translate(_DIGITS) for node in self.nodes}


class Edges:
    """The edges from each node to its successors (``after``), in order. There may be millions of
    edges, so their ends are two flat lists, and pairs are formed on demand."""

    def __init__(self, after: Mapping[int, Sequence[int]]) -> None:
        self.after = after
        sources = list(chain.from_iterable(map(repeat, after, map(len, after.values()))))
        self.ends = sources, list(chain.from_iterable(after.values()))

    def __len__(self) -> int:
        return len(self.ends[0])

    def __iter__(self) -> Iterator[Edge]:
        return zip(*self.ends, strict=True)

    def without(self, plane: int) -> dict[int, list[int]]:
        """Return the successors of each node by edges that are not in a plane."""
        banned = iter(self.flags(plane))
        return {n: [to for to in targets if not next(banned)] for n, targets in self.after.items()}

    def flags(self, plane: int) -> bytes:
        """Return, for each edge, 1 if it is in a plane, else 0."""
        return flags(plane, len(self))


class NoMeasureError(ValueError):
    """The absence of a progress measure: ``cycle`` meets all assumptions, but not the goal."""

    def __init__(self, cycle: tuple[int, ...]) -> None:
        super().__init__(f"node {cycle[0]} lies on a cycle that starves the goal")
        self.cycle = cycle


Measure = dict[str, list[Any]]
"""Number (``n``) and assumption (``a``) of each node."""


def measure(
    size: int,
    edges: tuple[Sequence[int], Sequence[int]],
    met: Sequence[int],
    excuses: Sequence[Sequence[int]],
) -> Measure:
    """Return the progress measure of a goal.

    ``size``: the number of nodes. ``edges``: two lists, the sources and the targets of the edges.
    ``met`` and each of ``excuses`` (assumptions; for a counterstrategy, goals): for each edge,
    whether the edge meets it. Raises NoMeasureError, with a cycle, if no measure exists.
    """
    sources, targets = edges
    missing: list[list[int]] = [[] for _ in range(size)]
    for edge in compress(range(len(met)), map(not_, met)):
        missing[sources[edge]].append(edge)
    numbers, component, wrong = [0] * size, [-1] * size, list[list[int]]()
    assumptions: list[int | None] = [None] * size
    parts = components([[targets[edge] for edge in out] for out in missing])
    for label, members in enumerate(parts):
        for node in members:
            component[node] = label
        inside, depth = [], 0
        for edge in chain.from_iterable(missing[node] for node in members):
            if component[targets[edge]] == label:
                inside.append(edge)
            else:
                depth = max(depth, numbers[targets[edge]] + 1)
        unmet = (k for k, flags in enumerate(excuses) if not any(flags[edge] for edge in inside))
        excuse = next(unmet, None) if inside else None
        if inside and excuse is None:
            wrong.append(sorted(inside))
        for node in members:
            numbers[node], assumptions[node] = depth, excuse
    if wrong:
        first = min(wrong)
        taken = [next(edge for edge in first if flags[edge]) for flags in excuses]
        ends = [[(sources[edge], targets[edge]) for edge in some] for some in (first, taken)]
        raise NoMeasureError(closed_walk(*ends))
    return {"n": numbers, "a": assumptions}


def closed_walk(edges: Sequence[Edge], required: Sequence[Edge]) -> tuple[int, ...]:
    """Return a closed walk over ``edges`` of one component that uses each ``required`` edge. Its
    first node is not repeated at the end."""
    successors: dict[int, list[int]] = {}
    for source, target in edges:
        successors.setdefault(source, []).append(target)
    required = required or edges[:1]
    walk = [required[0][0]]
    for source, target in (*required, required[0]):
        paths = reached(walk[-1:], lambda node: successors.get(node, ()))
        walk += (*path_to(source, paths)[1:], target)
    return tuple(walk[:-2])
