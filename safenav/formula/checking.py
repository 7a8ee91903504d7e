"""Checks of a formula against declared variables: names, types, ranges, primes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.formula import syntax

Bounds = tuple[int, int] | None
"""Range of an integer variable, None for a Boolean."""


class FormulaFlaw(Struct, frozen=True):
    """One error in a formula, at a column (from 1). ``unknown`` is the name that is not declared,
    so that the caller can suggest another."""

    column: int
    found: str
    hint: str = ""
    unknown: str = ""


def check(
    formula: syntax.Formula,
    declared: Mapping[str, Bounds],
    *,
    next_allowed: bool = True,
    ranges: bool = True,
) -> tuple[FormulaFlaw, ...]:
    """Return all errors of the formula by column, none if it can be used.

    ``declared`` maps the variables to their range, or None for Booleans. ``next_allowed`` is False
    for initial conditions. ``ranges``: a comparison with a number outside the range of its variable
    is also an error.
    """
    within = declared if ranges else {}
    found = _formula(formula, declared, within, next_allowed)
    return tuple(sorted(dict.fromkeys(found), key=lambda problem: problem.column))


def _formula(
    formula: syntax.Formula,
    declared: Mapping[str, Bounds],
    within: Mapping[str, Bounds],
    primes: bool,
) -> Iterator[FormulaFlaw]:
    match formula:
        case syntax.Name(name, _, column):
            yield from _name(formula, declared, primes)
            if declared.get(name) is not None:
                yield FormulaFlaw(column, f"the number {name} stands alone", f"write {name} = ...")
        case syntax.Comparison(relation, left, right):
            yield from _term(left, declared, primes)
            yield from _term(right, declared, primes)
            if relation in (syntax.Relation.EQUAL, syntax.Relation.UNEQUAL):
                yield from _range(left, right, within)
                yield from _range(right, left, within)
        case syntax.Next(operand) if not primes:
            # Its column is not recorded: that of its first name is near.
            column = next((name.column for name in syntax.names_of(operand)), 1)
            yield FormulaFlaw(column, "next(...) in an initial condition", _NO_NEXT)
    for operand in syntax.operands_of(formula):
        yield from _formula(operand, declared, within, primes or isinstance(formula, syntax.Next))


_NO_NEXT = "an initial condition refers to the first state only"


def _name(name: syntax.Name, declared: Mapping[str, Bounds], primes: bool) -> Iterator[FormulaFlaw]:
    if name.name not in declared:
        found = f"unknown variable {name.name!r}"
        yield FormulaFlaw(name.column, found, unknown=name.name)
    if name.primed and not primes:
        yield FormulaFlaw(name.column, f"the next value {name.name}' here", _NO_NEXT)


def _term(term: syntax.Term, declared: Mapping[str, Bounds], primes: bool) -> Iterator[FormulaFlaw]:
    for part in syntax.atoms_of(term):
        if isinstance(part, syntax.Name):
            yield from _name(part, declared, primes)
            if part.name in declared and declared[part.name] is None:
                found = f"{part.name} is Boolean and cannot be compared"
                yield FormulaFlaw(part.column, found, f"write {part.name} or !{part.name}")


def _range(
    term: syntax.Term, other: syntax.Term, declared: Mapping[str, Bounds]
) -> Iterator[FormulaFlaw]:
    if not (isinstance(term, syntax.Name) and isinstance(other, syntax.Number)):
        return
    bounds = declared.get(term.name)
    if bounds is not None and not bounds[0] <= other.value <= bounds[1]:
        found = f"{other.value} is outside the range of {term.name}"
        yield FormulaFlaw(other.column, found, f"{term.name} is from {bounds[0]} to {bounds[1]}")
