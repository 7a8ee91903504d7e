"""Counts of the completions of a partial transition, without enumeration.

For each row of known values (such as a state), it counts the valuations of the unknown variables
(such as the next inputs) that satisfy all constraints. It never enumerates the 2^n valuations:

- unconnected groups of variables are counted apart, and the counts multiplied;
- a constraint reads few of the known variables, so its verdict on every value of an unknown is
  computed once per valuation of those, as a bit mask, and looked up for the rows;
- connected variables with a large joint domain are split by the values of one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, cached_property, reduce
from itertools import compress, islice, product
from math import prod
from operator import and_, itemgetter, or_, xor

from msgspec import Struct

from safenav.components import components
from safenav.errors import ResourceLimitError
from safenav.formula import syntax
from safenav.formula.syntax import Connective, Operation
from safenav.spec.specification import Constraint, Variable

Vector = Sequence[int]
"""The bits of a natural number in each row, as planes, least significant first."""

Lookup = Callable[[str, bool], Vector]
"""A function that returns a variable's value (not its offset), now or (True) next."""


class Evaluator:
    """Evaluator of formulas on ``count`` rows. ``lookup`` returns a variable's bits, as planes."""

    def __init__(self, count: int, lookup: Lookup) -> None:
        self.everywhere = (1 << count) - 1
        self._number, self._compare = cache(lookup), cache(self._compared)
        self._order_of = cache(self._ordered)

    def holds(self, formula: syntax.Formula, primed: bool = False) -> int:
        """Return the plane of the rows in which a formula is true (in the next state if
        ``primed``)."""
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

    def _ordered(self, name: str, primed: bool, value: int, low: int = 0) -> tuple[int, int]:
        """Return two planes: the rows where a variable, without its lowest ``low`` bits, is less
        than ``value``, and those where it equals it. Values share the work for their upper bits."""
        planes, every = self._number(name, primed), self.everywhere
        if low == len(planes):
            return (every, 0) if value else (0, every)
        less, equal = self._order_of(name, primed, value >> 1, low + 1)
        if value & 1:
            return less | (equal & (every ^ planes[low])), equal & planes[low]
        return less, equal & (every ^ planes[low])

    def _compared(self, formula: syntax.Comparison, primed: bool) -> int:
        match formula:
            case syntax.Comparison(_, syntax.Name(name, own_prime), syntax.Number(value)):
                less, equal = self._order_of(name, primed or own_prime, value)
            case syntax.Comparison(_, left, right):
                less, equal = self._order(self._term(left, primed), self._term(right, primed))
        every, relation = self.everywhere, syntax.Relation
        planes = {relation.EQUAL: equal, relation.UNEQUAL: every ^ equal, relation.LESS: less}
        planes |= {relation.AT_MOST: less | equal, relation.AT_LEAST: every ^ less}
        return planes.get(formula.relation, every ^ (less | equal))

    def _order(self, left: Vector, right: Vector) -> tuple[int, int]:
        """Return two planes: the rows where left < right, and those where they are equal."""
        less, equal = 0, self.everywhere
        for i in reversed(range(max(len(left), len(right)))):
            a = left[i] if i < len(left) else 0
            b = right[i] if i < len(right) else 0
            differ = a ^ b
            less |= equal & differ & b
            equal &= self.everywhere ^ differ
        return less, equal


def add(left: Vector, right: Vector) -> Vector:
    """Return the sum of two numbers in each row. A number has a plane for each bit."""
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
    """Return the index of the first row in a plane that is not empty."""
    return (plane & -plane).bit_length() - 1


_BITS = bytes.maketrans(b"01", b"\x00\x01")


def flags(plane: int, count: int) -> bytes:
    """Return, for each of ``count`` rows, 1 if the row is in a plane, else 0."""
    return f"{plane:0{count}b}".encode().translate(_BITS)[::-1][:count]


_SOME = 256
"""Number of rows whose completions are counted together."""
_JOINT_DOMAIN = 1 << 12
_BLOCK_BITS = 1 << 22
_MOST_ROWS = 1 << 20
_WIDEST = 1 << 16

Row = tuple[int, ...]
"""Values of the known places, in their order."""


class Slot(Struct, frozen=True):
    """A variable in the present or, if ``primed``, the next state."""

    variable: Variable
    primed: bool

    @property
    def key(self) -> tuple[str, bool]:
        return self.variable.name, self.primed


Key = tuple[str, bool]


class Clause(Struct, frozen=True, dict=True):
    """A constraint with its parsed formula."""

    constraint: Constraint
    formula: syntax.Formula

    @cached_property
    def places(self) -> frozenset[Key]:
        """The slots to which the clause refers."""
        return frozenset(_keys(self.formula, False))

    @cached_property
    def holds(self) -> syntax.Predicate:
        return syntax.predicate(self.formula)


class Completions:
    """The completions of rows of ``known`` slots by values of the ``unknown`` slots."""

    def __init__(
        self, known: Sequence[Slot], unknown: Sequence[Slot], clauses: Sequence[Clause]
    ) -> None:
        self._known, self._unknown, self._clauses = known, unknown, clauses
        free = {place.key for place in unknown}
        settled = [clause for clause in clauses if not clause.places & free]
        tied = [clause for clause in clauses if clause.places & free]
        self._parts = [([], settled), *_components(unknown, tied)]

    def count(self, rows: Sequence[Row]) -> list[int]:
        """Return the number of completions of each row.

        Raises ResourceLimitError if the constraints connect too many unknown slots.
        """
        totals = dict.fromkeys(rows, 1)
        for places, tied in self._parts:
            some = [row for row, total in totals.items() if total]
            for row, count in zip(some, _counts(some, self._known, places, tied), strict=True):
                totals[row] *= count
        return [totals[row] for row in rows]

    def each(self, row: Row, decisive: frozenset[Key] | None = None) -> Iterator[Row]:
        """Yield the completions of a row in ascending order, only the first of those that agree up
        to the last ``decisive`` slot. Raises as ``count``."""
        return (longer[len(row) :] for longer in self._longer([row], decisive))

    def _longer(self, rows: Sequence[Row], decisive: frozenset[Key] | None) -> Iterator[Row]:
        """Yield the completed rows. A value is tried only if the other slots can be completed."""
        ranges = [place.variable.range for place in self._unknown]
        if decisive is not None and decisive.isdisjoint(place.key for place in self._unknown):
            for row in rows:
                yield from islice(self._longer([row], None), 1)
        elif (domain := prod(map(len, ranges))) <= _JOINT_DOMAIN:
            masks = _masks(rows, self._known, self._unknown, self._clauses)
            for row, mask in zip(rows, masks, strict=True):
                for values in compress(product(*ranges), flags(mask, domain)):
                    yield row + values
        else:
            longer = ((*row, value) for row in rows for value in ranges[0])
            while some := list(islice(longer, _SOME)):
                alive = list(compress(some, self._rest.count(some)))
                yield from self._rest._longer(alive, decisive)

    @cached_property
    def _rest(self) -> Completions:
        """The completions of rows with a value of the first unknown slot."""
        first, *others = self._unknown
        return Completions((*self._known, first), others, self._clauses)

    def unanswered(
        self, replies: Completions, row: Row = (), most: int | None = None
    ) -> Row | None:
        """Return a completion of a row that ``replies`` cannot complete; None if there is none
        among the first ``most`` that differ in slots of ``replies``."""
        read = frozenset[Key]().union(*(clause.places for clause in replies._clauses))
        first = sorted(self._unknown, key=lambda place: place.key not in read)
        order = [first.index(place) for place in self._unknown]
        found = islice(Completions(self._known, first, self._clauses).each(row, read), most)
        while some := [tuple([each[k] for k in order]) for each in islice(found, _SOME)]:
            counts = replies.count([(*row, *each) for each in some])
            if 0 in counts:
                return some[counts.index(0)]
        return None


def _counts(
    rows: Sequence[Row], known: Sequence[Slot], part: Sequence[Slot], tied: Sequence[Clause]
) -> list[int]:
    """Return, for each row, the number of valuations of connected slots that satisfy all."""
    domain = prod(len(place.variable.range) for place in part)
    if not tied:
        return [domain] * len(rows)
    if domain <= (_WIDEST if len(part) == 1 else _JOINT_DOMAIN):
        return [mask.bit_count() for mask in _masks(rows, known, part, tied)]
    places, keys, distinct = _projected(rows, known, tied)
    split = max(part, key=lambda place: sum(place.key in c.places for c in tied))
    if len(part) == 1 or len(distinct) * len(split.variable.range) > _MOST_ROWS:
        raise ResourceLimitError(
            "the strategy is too large to verify: its constraints tie too many values together"
        )
    rest = Completions((*places, split), [place for place in part if place is not split], tied)
    longer = [(*key, value) for key in distinct for value in split.variable.range]
    counts = dict.fromkeys(distinct, 0)
    for row, count in zip(longer, rest.count(longer), strict=True):
        counts[row[:-1]] += count
    return [counts[key] for key in keys]


def _components(
    unknown: Sequence[Slot], clauses: Sequence[Clause]
) -> Iterator[tuple[list[Slot], list[Clause]]]:
    """Yield the groups of unknown slots that constraints connect, each with these constraints."""
    index = {place.key: i for i, place in enumerate(unknown)}
    seen = [[index[key] for key in clause.places if key in index] for clause in clauses]
    graph: list[list[int]] = [[] for _ in unknown]
    for first, *others in seen:
        for other in others:
            graph[first].append(other)
            graph[other].append(first)
    for part in map(sorted, components(graph)):
        tied = [clause for clause, (one, *_) in zip(clauses, seen, strict=True) if one in part]
        yield [unknown[i] for i in part], tied


def _masks(
    rows: Sequence[Row], known: Sequence[Slot], part: Sequence[Slot], clauses: Sequence[Clause]
) -> list[int]:
    """Return, for each row, a mask of the valuations of ``part`` (bit d: the d-th of their product)
    that satisfy all clauses. Clauses that read the same known slots are evaluated together."""
    valuations = list(product(*(place.variable.range for place in part)))
    masks = [(1 << len(valuations)) - 1] * len(rows)
    free = {place.key for place in part}
    by_support: dict[frozenset[Key], list[Clause]] = {}
    for clause in clauses:
        by_support.setdefault(clause.places - free, []).append(clause)
    for some in by_support.values():
        places, keys, distinct = _projected(rows, known, some)
        allowed: dict[Row, int] = {}
        size = max(1, _BLOCK_BITS // len(valuations))
        for block in (distinct[k : k + size] for k in range(0, len(distinct), size)):
            columns = {place.key: k for k, place in enumerate((*places, *part))}
            allowed.update(zip(block, _block(block, columns, valuations, some), strict=True))
        masks = [mask & allowed[key] for mask, key in zip(masks, keys, strict=True)]
    return masks


def _projected(
    rows: Sequence[Row], known: Sequence[Slot], clauses: Sequence[Clause]
) -> tuple[list[Slot], list[Row], list[Row]]:
    """Return the known slots that clauses read, the values of these slots in each row, and the
    distinct values."""
    read = frozenset[Key]().union(*(clause.places for clause in clauses))
    columns = [column for column, place in enumerate(known) if place.key in read]
    if len(columns) > 1:
        keys = list(map(itemgetter(*columns), rows))
    else:
        keys = [tuple(row[column] for column in columns) for row in rows]
    return [known[column] for column in columns], keys, list(dict.fromkeys(keys))


def _block(
    keys: Sequence[Row],
    columns: Mapping[Key, int],
    valuations: Sequence[Row],
    clauses: Sequence[Clause],
) -> list[int]:
    """Return, for each key, a mask of the valuations that satisfy all clauses. ``columns``: the
    position of each slot in a key and its valuation."""
    width = (len(valuations) + 7) // 8  # bytes per key in a plane
    blanks = (bytes(width), b"\xff" * width)

    def lookup(name: str, primed: bool) -> Vector:
        column = columns[name, primed] - len(keys[0])
        values = [row[column] for row in (keys if column < 0 else valuations)]
        planes = []
        for bit in range(max(1, max(values).bit_length())):
            bits = [value >> bit & 1 for value in values]
            if column < 0:
                plane = b"".join([blanks[one] for one in bits])
            else:
                packed = int("".join(map(str, reversed(bits))), 2)
                plane = packed.to_bytes(width, "little") * len(keys)
            planes.append(int.from_bytes(plane, "little"))
        return planes

    evaluator = Evaluator(len(keys) * width * 8, lookup)
    result = reduce(and_, (evaluator.holds(clause.formula) for clause in clauses))
    data = result.to_bytes(len(keys) * width, "little")
    inside = (1 << len(valuations)) - 1
    return [
        int.from_bytes(data[i : i + width], "little") & inside for i in range(0, len(data), width)
    ]


def _keys(formula: syntax.Formula, primed: bool) -> Iterator[Key]:
    """Yield each variable of a formula and whether it refers to the next state."""
    if isinstance(formula, syntax.Name | syntax.Comparison):
        yield from ((name.name, primed or name.primed) for name in syntax.names_of(formula))
    for operand in syntax.operands_of(formula):
        yield from _keys(operand, primed or syntax.is_next(formula))
