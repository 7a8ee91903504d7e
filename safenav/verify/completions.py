"""Truth of formulas on many rows in parallel, and the completions of a partial transition: the
valuations of its unknown variables (the next inputs, say) that satisfy all constraints.

Bit r of a Python integer is that of row r. A row is a state, a transition, or a partial one. Each
bit of a variable is a plane, an integer with one bit for each row; connectives are single
operations on planes, and comparisons and sums are the circuits that a processor has for them. For
Boolean work this beats arrays of bytes (an operation on a million rows moves 125 kB), and it needs
no import: on the hundred nodes of a typical strategy, loading an array library would cost more than
all the checking.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from functools import cache, cached_property, partial, reduce
from itertools import islice
from operator import and_, or_, xor

from msgspec import Struct

from safenav.errors import ResourceLimitError
from safenav.formula import syntax
from safenav.formula.syntax import Connective, Operation
from safenav.spec.specification import Constraint, Variable

Vector = Sequence[int]
"""Planes of a natural number, least significant first."""

Lookup = Callable[[str, bool], Vector]
"""The true value (not the offset from its minimum) of a variable, now or (True) next."""


class Evaluator:
    """Evaluates formulas on ``count`` rows; ``lookup`` returns the planes of a variable."""

    def __init__(self, count: int, lookup: Lookup) -> None:
        self.everywhere = (1 << count) - 1
        self._number, self._compare = cache(lookup), cache(self._compared)

    def holds(self, formula: syntax.Formula, primed: bool = False) -> int:
        """Return the rows in which ``formula`` is true; ``primed`` evaluates it in the next
        state."""
        match formula:
            case syntax.Name(name, own_prime):
                return self._number(name, primed or own_prime)[0]
            case syntax.Comparison():
                return self._compare(formula, primed)
            case Operation(Connective.NEXT, (operand,)):
                return self.holds(operand, True)
            case Operation(operator, operands):
                planes, every = [self.holds(part, primed) for part in operands], self.everywhere
                match operator:
                    case Connective.AND:
                        return reduce(and_, planes)
                    case Connective.OR:
                        return reduce(or_, planes)
                    case Connective.NOT:
                        return every ^ planes[0]
                    case Connective.IMPLIES:
                        return (every ^ planes[0]) | planes[1]
                    case Connective.IFF:
                        return every ^ planes[0] ^ planes[1]
                return reduce(xor, planes)
            case syntax.Constant(value):
                return self.everywhere if value else 0

    def _term(self, term: syntax.Term, primed: bool) -> Vector:
        match term:
            case syntax.Number(value):
                return self.constant(value)
            case syntax.Name(name, own_prime):
                return self._number(name, primed or own_prime)
            case syntax.Sum(terms):
                return reduce(add, (self._term(part, primed) for part in terms))

    def constant(self, value: int) -> Vector:
        return [self.everywhere if value >> i & 1 else 0 for i in range(value.bit_length())]

    def _compared(self, formula: syntax.Comparison, primed: bool) -> int:
        less, equal = self._order(
            self._term(formula.left, primed), self._term(formula.right, primed)
        )
        every, relation = self.everywhere, syntax.Relation
        planes = {relation.EQUAL: equal, relation.UNEQUAL: every ^ equal, relation.LESS: less}
        planes |= {relation.AT_MOST: less | equal, relation.AT_LEAST: every ^ less}
        return planes.get(formula.relation, every ^ (less | equal))

    def _order(self, left: Vector, right: Vector) -> tuple[int, int]:
        """Return where left < right, and where they are equal, by the highest difference."""
        less, equal = 0, self.everywhere
        for i in reversed(range(max(len(left), len(right)))):
            a = left[i] if i < len(left) else 0
            b = right[i] if i < len(right) else 0
            differ = a ^ b
            less |= equal & differ & b
            equal &= self.everywhere ^ differ
        return less, equal


def add(left: Vector, right: Vector) -> Vector:
    """Return the sum of two numbers in each row, with as many bits as it needs."""
    total = []
    carry = 0
    for i in range(max(len(left), len(right))):
        a = left[i] if i < len(left) else 0
        b = right[i] if i < len(right) else 0
        differ = a ^ b
        total.append(differ ^ carry)
        carry = (a & b) | (differ & carry)
    if carry:
        total.append(carry)
    return total


def first_row(plane: int) -> int:
    """Return the number of the first row in a plane that is not empty."""
    return (plane & -plane).bit_length() - 1


_WIDEST = 1 << 16
_BLOCK_BITS = 1 << 22

Row = tuple[int, ...]
"""Values of the known places, in their order."""


class Slot(Struct, frozen=True):
    """A variable now, or (``primed``) in the next state."""

    variable: Variable
    primed: bool

    @property
    def key(self) -> tuple[str, bool]:
        return self.variable.name, self.primed


Key = tuple[str, bool]


class Clause(Struct, frozen=True, dict=True):
    """A constraint with its formula."""

    constraint: Constraint
    formula: syntax.Formula

    @cached_property
    def places(self) -> frozenset[Key]:
        """The variables that it refers to, now or next."""
        return frozenset(_keys(self.formula, False))

    @cached_property
    def holds(self) -> syntax.Predicate:
        return syntax.predicate(self.formula)


class Completions:
    """Completes rows over ``known`` places with values of the ``unknown`` ones. Which values of a
    place satisfy the clauses that it is the last to decide is computed once for each valuation of
    the other places of these clauses."""

    def __init__(
        self, known: Sequence[Slot], unknown: Sequence[Slot], clauses: Sequence[Clause]
    ) -> None:
        self._known, self._unknown, self._counts = len(known), unknown, dict[Row, int]()
        column = {place.key: k for k, place in enumerate((*known, *unknown))}
        read = {key for clause in clauses for key in clause.places}
        self._read = sorted(column[key] for key in read if column[key] < len(known))
        alike: dict[tuple[Slot | None, frozenset[Key]], list[syntax.Formula]] = {}
        for clause in clauses:
            last = max((column[key] for key in clause.places), default=-1) - len(known)
            place = unknown[last] if last >= 0 else None
            support = clause.places - ({place.key} if place else set())
            alike.setdefault((place, support), []).append(clause.formula)
        self._tables: dict[Slot | None, list[_Table]] = {}
        for (place, support), formulas in alike.items():
            table = _Table(place, {key: column[key] for key in support}, formulas)
            self._tables.setdefault(place, []).append(table)

    def prepare(self, rows: Sequence[Row]) -> None:
        """Compute what known values decide for many rows in parallel."""
        for table in (table for tables in self._tables.values() for table in tables):
            if all(column < self._known for column in table.columns.values()):
                table.fill(rows)

    def each(self, row: Row) -> Iterator[Row]:
        """Yield the completions of one row in ascending order."""
        if all(table(row) for table in self._tables.get(None, ())):
            yield from self._extended(row)

    def _extended(self, row: Row) -> Iterator[Row]:
        depth = len(row) - self._known
        if depth == len(self._unknown):
            yield row[self._known :]
            return
        place = self._unknown[depth]
        masks = [table(row) for table in self._tables.get(place, ())]
        for k, value in enumerate(place.variable.range):
            if all(mask >> k & 1 for mask in masks):
                yield from self._extended((*row, value))

    def missing(self, row: Row, there: Set[Row]) -> Row | None:
        """Return a completion of a row that is not ``there``, if one of them is missing. Counting
        usually suffices: all that is there is a completion, or another fault."""
        key = tuple([row[column] for column in self._read])
        if self._counts.get(key) == len(there):
            return None
        found = [*islice(self.each(row), len(there) + 1)]
        missing = next((each for each in found if each not in there), None)
        if missing is None:
            self._counts[key] = len(found)
        return missing


class _Table:
    """The values of a place (bit k: the k-th one; without a place bit 0) that satisfy formulas, for
    each valuation of the other places that these read. ``columns``: where rows have these."""

    def __init__(
        self, place: Slot | None, columns: Mapping[Key, int], formulas: Sequence[syntax.Formula]
    ) -> None:
        values = range(1) if place is None else place.variable.range
        if place is not None and len(values) > _WIDEST:
            raise ResourceLimitError(
                f"the strategy is too large to verify: {place.variable.name} has {len(values):,} "
                f"values, and constraints on it; at most {_WIDEST:,} can be verified"
            )
        self._own, self._values, self._formulas = place and place.key, values, formulas
        self.columns, self._masks = columns, dict[Row, int]()

    def __call__(self, row: Row) -> int:
        key = tuple([row[column] for column in self.columns.values()])
        if key not in self._masks:
            self.fill([row])
        return self._masks[key]

    def fill(self, rows: Sequence[Row]) -> None:
        columns, size = self.columns.values(), len(self._values)
        keys = list(dict.fromkeys(tuple([row[column] for column in columns]) for row in rows))
        block = max(1, _BLOCK_BITS // size)
        for start in range(0, len(keys), block):
            some = keys[start : start + block]
            evaluator = Evaluator(len(some) * size, partial(self._planes, some))
            found = reduce(and_, map(evaluator.holds, self._formulas))
            digits = f"{found:0{len(some) * size}b}"
            for k, key in enumerate(some):
                self._masks[key] = int(digits[k * size : (k + 1) * size], 2)

    def _planes(self, keys: Sequence[Row], name: str, primed: bool) -> Vector:
        """Return the planes of a variable on the pairs of a key and a value, the last one first."""
        if (name, primed) == self._own:
            values, width, times = list(reversed(self._values)), 1, len(keys)
        else:
            column = [*self.columns].index((name, primed))
            values, width, times = [key[column] for key in keys], len(self._values), 1
        bits = range(max(1, max(values).bit_length()))
        digits = [["01"[value >> bit & 1] * width for value in values] for bit in bits]
        return [int("".join(each) * times, 2) for each in digits]


def unanswered(rows: Iterable[Row], answers: Completions, known: Row = ()) -> Row | None:
    """Return the first of some rows that has no completion after the ``known`` values."""
    return next((row for row in rows if answers.missing((*known, *row), set()) is None), None)


def _keys(formula: syntax.Formula, primed: bool) -> Iterator[Key]:
    """Yield the occurrences of variables; those inside ``next(...)`` count as primed."""
    if isinstance(formula, syntax.Name | syntax.Comparison):
        yield from ((name.name, primed or name.primed) for name in syntax.names_of(formula))
    for operand in syntax.operands_of(formula):
        yield from _keys(operand, primed or syntax.is_next(formula))
