"""Formulas of random and of parsed specifications: an abstract syntax, nothing more.

Integers live in `Compare` only, as sums of variables and constants, as in structuredslugs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Connective = Literal["&", "|", "^", "->", "<->"]
Relation = Literal["=", "!=", "<", "<=", ">", ">="]


@dataclass(frozen=True)
class Constant:
    value: bool


@dataclass(frozen=True)
class Atom:
    """A Boolean variable, now or (primed) after the transition."""

    name: str
    primed: bool = False


@dataclass(frozen=True)
class Not:
    operand: Formula


@dataclass(frozen=True)
class Binary:
    op: Connective
    left: Formula
    right: Formula


@dataclass(frozen=True)
class Number:
    """A summand: a constant, or the value of an integer variable."""

    value: int | str
    primed: bool = False


@dataclass(frozen=True)
class Compare:
    relation: Relation
    left: tuple[Number, ...]
    right: tuple[Number, ...]


@dataclass(frozen=True)
class Next:
    """`next(f)` of structuredslugs; `f` has no primed variable."""

    operand: Formula


Formula = Constant | Atom | Not | Binary | Compare | Next

TRUE = Constant(True)
FALSE = Constant(False)


def prime(formula: Formula) -> Formula:
    """The formula with every variable primed: what `next(...)` means."""
    match formula:
        case Constant():
            return formula
        case Atom(name, _):
            return Atom(name, True)
        case Not(operand):
            return Not(prime(operand))
        case Binary(op, left, right):
            return Binary(op, prime(left), prime(right))
        case Compare(relation, left, right):
            return Compare(relation, _prime_sum(left), _prime_sum(right))
        case Next(operand):
            return prime(operand)


def _prime_sum(numbers: tuple[Number, ...]) -> tuple[Number, ...]:
    return tuple(Number(n.value, isinstance(n.value, str)) for n in numbers)


def is_boolean(formula: Formula) -> bool:
    """Whether slugsin can say it without bits: no integers in it."""
    match formula:
        case Constant() | Atom():
            return True
        case Not(operand) | Next(operand):
            return is_boolean(operand)
        case Binary(_, left, right):
            return is_boolean(left) and is_boolean(right)
        case Compare():
            return False
