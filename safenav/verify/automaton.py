"""An automaton and its specification, prepared for checking: what both kinds of check share.

Only what can be reached from the given start nodes is looked at, in breadth-first order, so
that the first fault that is found is also one of the nearest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache

from safenav.dataclass import dataclass
from safenav.errors import Diagnostic, InputError
from safenav.formula.parser import FormulaError, parse
from safenav.formula.syntax import Formula
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.export import in_words
from safenav.synthesis.strategy import Field, Strategy
from safenav.verify.bitparallel import Evaluator, Vector, add, rows_of
from safenav.verify.completions import Completions, Condition, Row, Slot, condition_of
from safenav.verify.cycles import Edge
from safenav.verify.failures import Failure, Fault

_BLOCK_EDGES = 1 << 16
_DIGITS = bytes.maketrans(b"\x00\x01", b"01")

_parse = lru_cache(maxsize=1 << 15)(parse)


@dataclass(frozen=True)
class Clause:
    """A constraint together with its formula."""

    constraint: Constraint
    condition: Condition

    @property
    def formula(self) -> Formula:
        return self.condition.formula


class Automaton:
    """The part of ``strategy`` that is reachable from ``starts``."""

    def __init__(self, spec: Specification, strategy: Strategy, starts: Sequence[int]) -> None:
        self.spec = spec
        self.strategy = strategy
        self.starts = tuple(starts)
        self.current = tuple(Slot(v, False) for v in spec.variables)
        self.next_inputs = tuple(Slot(v, True) for v in spec.owned(Owner.INPUT))
        self.next_outputs = tuple(Slot(v, True) for v in spec.owned(Owner.OUTPUT))
        self._parent = {node: node for node in self.starts}
        self.nodes = list(self._parent)
        for node in self.nodes:  # grows while it is gone through: breadth first
            for target in strategy.transitions[node]:
                if target not in self._parent:
                    self._parent[target] = node
                    self.nodes.append(target)
        self.edges: list[Edge] = [(n, t) for n in self.nodes for t in strategy.transitions[n]]

    def clauses(self, section: Section) -> list[Clause]:
        return clauses(self.spec, section)

    @cached_property
    def values(self) -> dict[int, Row]:
        """All variables of each node, in the specification's order."""
        ordered = [self._fields[variable.name] for variable in self.spec.variables]
        states = self.strategy.states
        return {n: tuple([field.decode(states[n]) for field in ordered]) for n in self.nodes}

    def part(self, node: int, owner: Owner) -> Row:
        """The inputs or the outputs of a node, in the specification's order."""
        return self._parts[owner][node]

    @cached_property
    def _parts(self) -> dict[Owner, dict[int, Row]]:
        variables = self.spec.variables
        columns = {o: [i for i, v in enumerate(variables) if v.owner is o] for o in Owner}
        return {
            owner: {n: tuple([row[i] for i in own]) for n, row in self.values.items()}
            for owner, own in columns.items()
        }

    def violated(self, formulas: Sequence[Formula]) -> list[list[int]]:
        """For each formula, the edges (by index, ascending) that do not satisfy it."""
        found: list[list[int]] = [[] for _ in formulas]
        for start in range(0, len(self.edges), _BLOCK_EDGES):
            block = self.edges[start : start + _BLOCK_EDGES]
            evaluator = self._evaluator(block)
            for indices, formula in zip(found, formulas, strict=True):
                wrong = evaluator.everywhere ^ evaluator.holds(formula)
                if wrong:
                    indices.extend(start + row for row in rows_of(wrong))
        return found

    def range_failures(self) -> Iterator[Failure]:
        """Integers whose bits hold more than their range."""
        for place, column in zip(self.current, range(len(self.current)), strict=True):
            for node in self.nodes:
                if self.values[node][column] not in place.range:
                    detail = f"{place.variable.declaration}, found {self.values[node][column]}"
                    yield self.failure(Fault.RANGE, node, detail=detail)
                    break

    def completions(
        self, known: Sequence[Slot], unknown: Sequence[Slot], found: Sequence[Clause]
    ) -> Completions:
        return Completions(known, unknown, [clause.condition for clause in found])

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
        """A shortest path from a start node."""
        path = [node]
        while self._parent[path[-1]] != path[-1]:
            path.append(self._parent[path[-1]])
        return tuple(path[::-1])

    def in_words(self, node: int) -> str:
        values = self.strategy.values(node)
        words = [in_words(self.strategy, values, o) for o in (Owner.OUTPUT, Owner.INPUT)]
        return " ".join(filter(None, words))

    def move_in_words(self, places: Sequence[Slot], row: Row) -> str:
        """A valuation of inputs or of outputs."""
        if not places:
            return "nothing to choose"
        values = {p.variable.name: v for p, v in zip(places, row, strict=True)}
        return in_words(self.strategy, values, places[0].variable.owner)

    def _evaluator(self, block: Sequence[Edge]) -> Evaluator:
        width = len(self.strategy.states[0])
        ends = [b"".join([self._digits[edge[end]] for edge in block]) for end in (0, 1)]

        def lookup(name: str, primed: bool) -> Vector:
            field = self._fields[name]
            digits = ends[primed]
            last = len(digits) - width
            # The digits of one column from the last edge to the first, read as a number.
            raw = [int(digits[last + column :: -width], 2) for column in field.columns]
            if field.variable.bounds is None:
                return raw
            return add(raw, evaluator.constant(field.base))

        evaluator = Evaluator(len(block), lookup)
        return evaluator

    @cached_property
    def _fields(self) -> dict[str, Field]:
        return {field.variable.name: field for field in self.strategy.fields}

    @cached_property
    def _digits(self) -> dict[int, bytes]:
        states = self.strategy.states
        return {node: bytes(states[node]).translate(_DIGITS) for node in self.nodes}


def clauses(spec: Specification, section: Section) -> list[Clause]:
    """The parsed constraints of a section.

    Raises InputError for one that cannot be read or names something undeclared.
    """
    declared = {variable.name for variable in spec.variables}
    found = []
    for constraint in spec.section(section):
        try:
            condition = condition_of(_parse(constraint.formula))
        except FormulaError as error:
            raise _unreadable(constraint, error.column, error.found, error.hint) from error
        unknown = sorted({name for name, _ in condition.places} - declared)
        if unknown:
            raise _unreadable(constraint, 1, f"'{unknown[0]}' is not declared", "")
        found.append(Clause(constraint, condition))
    return found


def _unreadable(constraint: Constraint, column: int, found: str, hint: str) -> InputError:
    place = f"{constraint.origin.item}: [{constraint.section}] {constraint.formula}"
    return InputError([Diagnostic(place, 1, column, found, hint)])
