"""Formulas of the structured-slugs expression language: syntax tree, text and evaluation.

``&``, ``|`` and ``^`` are associative and have any number of operands, which keeps the long chains
of generated specifications flat. ``->`` and ``<->`` associate to the left. Columns count from 1 (0:
the tree was not parsed).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from enum import StrEnum
from operator import eq, ge, gt, le, lt, ne

from msgspec import Struct

RESERVED_WORDS = frozenset({"TRUE", "FALSE", "next", "X", "F", "G", "U", "W"})
"""Words that cannot name a variable of a scenario: constants and temporal operators."""


class Relation(StrEnum):
    EQUAL = "="
    UNEQUAL = "!="
    LESS = "<"
    AT_MOST = "<="
    GREATER = ">"
    AT_LEAST = ">="


class Constant(Struct, frozen=True):
    """TRUE or FALSE. ``column``: the position of a constant written as 1 or 0."""

    value: bool
    column: int = 0


class Number(Struct, frozen=True):
    """A non-negative number in a comparison."""

    value: int
    column: int = 0


class Name(Struct, frozen=True):
    """A Boolean or integer variable's value, now or (``primed``) in the next state."""

    name: str
    primed: bool = False
    column: int = 0


class Sum(Struct, frozen=True):
    """A sum of at least two terms, without wrap-around."""

    terms: tuple[Name | Number, ...]


class Comparison(Struct, frozen=True):
    relation: Relation
    left: Term
    right: Term


class Connective(StrEnum):
    NOT = "!"
    NEXT = "next"
    AND = "&"
    OR = "|"
    XOR = "^"
    IMPLIES = "->"
    IFF = "<->"


class Operation(Struct, frozen=True):
    """Formulas joined by an operator: one for ``!`` and ``next(...)`` (about the next state,
    without primes), two for ``->`` and ``<->``, any number for other operators. ``^`` is true if an
    odd number of its formulas is true."""

    operator: Connective
    operands: tuple[Formula, ...]


PRECEDENCE: Mapping[str, int] = {
    **{"<->": 1, "->": 2, "^": 3, "|": 4, "&": 5, "!": 6, "+": 8},
    **dict.fromkeys(Relation, 7),
}

Term = Name | Number | Sum
Formula = Constant | Name | Comparison | Operation


def operands_of(formula: Formula) -> tuple[Formula, ...]:
    """Return the formulas that an operator joins, from left to right; none for an atom."""
    return formula.operands if isinstance(formula, Operation) else ()


def is_next(formula: Formula) -> bool:
    """Return whether a formula is ``next(...)``."""
    return isinstance(formula, Operation) and formula.operator is Connective.NEXT


def atoms_of(term: Term) -> tuple[Name | Number, ...]:
    """Return the summands of a term."""
    return term.terms if isinstance(term, Sum) else (term,)


def names_of(formula: Formula) -> Iterator[Name]:
    """Yield every occurrence of a variable, from left to right."""
    if isinstance(formula, Name):
        yield formula
    elif isinstance(formula, Comparison):
        atoms = (*atoms_of(formula.left), *atoms_of(formula.right))
        yield from (atom for atom in atoms if isinstance(atom, Name))
    for operand in operands_of(formula):
        yield from names_of(operand)


def reads_next(formula: Formula) -> bool:
    """Return whether a formula also refers to the next state."""
    deeper = any(map(reads_next, operands_of(formula)))
    return is_next(formula) or deeper or any(name.primed for name in names_of(formula))


def variables(formula: Formula) -> frozenset[str]:
    """Return the names of all variables, primed or not."""
    return frozenset(name.name for name in names_of(formula))


def resolve_constants(
    formula: Formula, meaning: Callable[[Name, Comparison], Collection[int] | None]
) -> Formula:
    """Return the formula with the names in its comparisons replaced by their numbers from
    ``meaning``, if any. If a name has several numbers, each is compared."""

    def numbers(part: Term, within: Comparison) -> list[Number]:
        if not isinstance(part, Name) or part.primed:
            return []
        return [Number(value, part.column) for value in sorted(meaning(part, within) or ())]

    def term(whole: Term, within: Comparison) -> Term:
        atoms = list[Name | Number]()
        for part in atoms_of(whole):
            found = numbers(part, within)
            atoms += found if len(found) == 1 else [part]
        return Sum(tuple(atoms)) if isinstance(whole, Sum) else atoms[0]

    def walk(node: Formula) -> Formula:
        match node:
            case Comparison(relation, left, right):
                for name, other in ((right, left), (left, right)):
                    several = numbers(name, node)
                    if len(several) > 1 and relation in (Relation.EQUAL, Relation.UNEQUAL):
                        each = (walk(Comparison(relation, other, one)) for one in several)
                        join = Connective.OR if relation is Relation.EQUAL else Connective.AND
                        return Operation(join, tuple(each))
                return Comparison(relation, term(left, node), term(right, node))
            case Operation(operator, operands):
                return Operation(operator, tuple(map(walk, operands)))
        return node

    return walk(formula)


def one_of(variable: str, values: Iterable[int], prime: str = "") -> str:
    """Return a formula's text: ``variable`` has one of the values. It binds like an atom."""
    atoms = [f"{variable}{prime} = {value:d}" for value in sorted(values)]
    return atoms[0] if len(atoms) == 1 else "(" + " | ".join(atoms) + ")"


def to_text(formula: Formula) -> str:
    """Return the formula in structured slugs, on one line."""
    match formula:
        case Constant(value):
            return "TRUE" if value else "FALSE"
        case Name():
            return _term(formula)
        case Comparison(relation, left, right):
            return f"{_term(left)} {relation.value} {_term(right)}"
        case Operation(Connective.NEXT, (operand,)):
            return f"next({to_text(operand)})"
        case Operation(Connective.NOT, (operand,)):
            # "!x = 3" would parse correctly, but readers should not have to know that.
            return "!" + _within(operand, PRECEDENCE["!"], isinstance(operand, Comparison))
        case Operation(operator, operands):
            rank, pairs = PRECEDENCE[operator], operator in (Connective.IMPLIES, Connective.IFF)
            first = _within(operands[0], rank if pairs else rank + 1)
            rest = (_within(operand, rank + 1) for operand in operands[1:])
            return f" {operator.value} ".join((first, *rest))


def _within(formula: Formula, lowest: int, parentheses: bool = False) -> str:
    """Return the text of a formula, in parentheses if its precedence is below ``lowest``."""
    rank = PRECEDENCE.get(formula.operator) if isinstance(formula, Operation) else None
    text = to_text(formula)
    return f"({text})" if parentheses or (rank is not None and rank < lowest) else text


def _term(term: Term) -> str:
    match term:
        case Number(value):
            return str(value)
        case Name(name, primed):
            return name + "'" if primed else name
        case Sum(terms):
            return " + ".join(_term(part) for part in terms)


State = Mapping[str, int | bool]
Predicate = Callable[[State, State], bool]

_RELATIONS = dict(zip(Relation, (eq, ne, lt, le, gt, ge), strict=True))


def predicate(formula: Formula) -> Predicate:
    """Return a function that evaluates the formula in a state with a given successor. It raises
    KeyError for a variable without a value."""
    match formula:
        case Constant(value):
            return lambda _, __: value
        case Name():
            term = _value(formula)
            return lambda now, then: bool(term(now, then))
        case Comparison(relation, left, right):
            compare, low, high = _RELATIONS[relation], _value(left), _value(right)
            return lambda now, then: compare(low(now, then), high(now, then))
        case Operation(Connective.NEXT, (operand,)):
            part = predicate(operand)
            return lambda _, then: part(then, then)
        case Operation(operator, operands):
            parts, joined = [predicate(operand) for operand in operands], _TRUTH[operator]
            return lambda now, then: joined(part(now, then) for part in parts)


_TRUTH: Mapping[Connective, Callable[[Iterator[bool]], bool]] = {
    Connective.NOT: lambda values: not next(values),
    Connective.AND: all,
    Connective.OR: any,
    Connective.XOR: lambda values: sum(values) % 2 == 1,
    Connective.IMPLIES: lambda values: not next(values) or next(values),
    Connective.IFF: lambda values: next(values) == next(values),
}
"""The truth value of an operation, from those of its operands."""


def _value(term: Term) -> Callable[[State, State], int]:
    match term:
        case Number(value):
            return lambda _, __: value
        case Name(name, True):
            return lambda _, then: int(then[name])
        case Name(name):
            return lambda now, _: int(now[name])
        case Sum(terms):
            parts = [_value(part) for part in terms]
            return lambda now, then: sum(part(now, then) for part in parts)
