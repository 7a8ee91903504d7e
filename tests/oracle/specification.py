"""A specification as the oracle sees it: declared variables and six lists of formulas.

Formulas are an abstract syntax, nothing more. Integers live in `Compare` only, as sums of variables
and constants, as in structuredslugs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

Operator = Literal["!", "next", "&", "|", "^", "->", "<->"]
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
class Operation:
    """The operand of `next`, as in structuredslugs, has no primed variable."""

    operator: Operator
    operands: tuple[Formula, ...]


Formula = Constant | Atom | Compare | Operation


def apply(operator: Operator, *operands: Formula) -> Operation:
    return Operation(operator, operands)


def parts(formula: Formula) -> Iterator[Formula]:
    """The formula and all in it, from the outside."""
    yield formula
    for operand in formula.operands if isinstance(formula, Operation) else ():
        yield from parts(operand)


def has_integers(formula: Formula) -> bool:
    """Whether slugsin can say it with bits only."""
    return any(isinstance(part, Compare) for part in parts(formula))


def prime(formula: Formula) -> Formula:
    """The formula with every variable primed: what `next(...)` means."""
    match formula:
        case Atom(name):
            return Atom(name, True)
        case Compare(relation, left, right):
            later = [[Number(n.value, isinstance(n.value, str)) for n in s] for s in (left, right)]
            return Compare(relation, *map(tuple, later))
        case Operation(operator, operands):
            return Operation(operator, tuple(map(prime, operands)))
    return formula


Owner = Literal["input", "output"]


@dataclass(frozen=True)
class Variable:
    """A Boolean (no range) or an integer with `low <= value <= high`."""

    name: str
    owner: Owner
    range: tuple[int, int] | None = None

    @property
    def bits(self) -> tuple[str, ...]:
        """Names of its bits, least significant first (`x@0.min.max`, `x@1`, ...)."""
        if self.range is None:
            return (self.name,)
        low, high = self.range
        first = f"{self.name}@0.{low}.{high}"
        others = [f"{self.name}@{i}" for i in range(1, (high - low).bit_length())]
        return (first, *others) if low < high else ()


Section = Literal["env_init", "sys_init", "env_trans", "sys_trans", "env_liveness", "sys_liveness"]
SECTIONS: tuple[Section, ...] = get_args(Section)


@dataclass(frozen=True)
class Specification:
    """Variables in declaration order, which fixes the lexicographic order of states."""

    variables: tuple[Variable, ...]
    env_init: tuple[Formula, ...] = ()
    sys_init: tuple[Formula, ...] = ()
    env_trans: tuple[Formula, ...] = ()
    sys_trans: tuple[Formula, ...] = ()
    env_liveness: tuple[Formula, ...] = ()
    sys_liveness: tuple[Formula, ...] = ()

    @property
    def bits(self) -> tuple[str, ...]:
        """In the order in which a strategy prints them."""
        return tuple(bit for variable in self.variables for bit in variable.bits)

    def is_boolean(self) -> bool:
        """Whether it can be written in slugsin as it stands."""
        formulas = (formula for section in SECTIONS for formula in self.section(section))
        return all(v.range is None for v in self.variables) and not any(map(has_integers, formulas))

    def section(self, name: Section) -> tuple[Formula, ...]:
        formulas: tuple[Formula, ...] = getattr(self, name)
        return formulas
