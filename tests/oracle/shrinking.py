"""Makes a failing specification small: one change at a time, until none keeps it failing."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from oracle.formula import FALSE, TRUE, Atom, Binary, Compare, Formula, Next, Not
from oracle.specification import SECTIONS, Specification

Fails = Callable[[Specification], bool]


def shrink(specification: Specification, fails: Fails, attempts: int = 2000) -> Specification:
    """The smallest specification found for which `fails` still holds."""
    progress = True
    while progress and attempts > 0:
        progress = False
        for smaller in _smaller(specification):
            attempts -= 1
            if attempts <= 0:
                break
            if fails(smaller):
                specification, progress = smaller, True
                break
    return specification


def _smaller(specification: Specification) -> Iterator[Specification]:
    for section in SECTIONS:
        formulas = specification.section(section)
        for i in range(len(formulas)):
            yield specification.with_section(section, formulas[:i] + formulas[i + 1 :])
    used = {
        name
        for section in SECTIONS
        for formula in specification.section(section)
        for name in _names(formula)
    }
    for i, variable in enumerate(specification.variables):
        if variable.name not in used:
            variables = specification.variables[:i] + specification.variables[i + 1 :]
            yield replace(specification, variables=variables)
    for section in SECTIONS:
        formulas = specification.section(section)
        for i, formula in enumerate(formulas):
            for simpler in _simpler(formula):
                changed = (*formulas[:i], simpler, *formulas[i + 1 :])
                yield specification.with_section(section, changed)


def _simpler(formula: Formula) -> Iterator[Formula]:
    if formula not in (TRUE, FALSE):
        yield TRUE
        yield FALSE
    match formula:
        case Not(operand):
            yield operand
            yield from (Not(o) for o in _simpler(operand))
        case Next(operand):
            yield from (Next(o) for o in _simpler(operand))
        case Binary(op, left, right):
            yield left
            yield right
            yield from (Binary(op, simpler, right) for simpler in _simpler(left))
            yield from (Binary(op, left, simpler) for simpler in _simpler(right))
        case Compare(relation, left, right):
            if len(left) > 1:
                yield Compare(relation, left[:1], right)
            if len(right) > 1:
                yield Compare(relation, left, right[:1])
        case _:
            pass


def _names(formula: Formula) -> set[str]:
    match formula:
        case Atom(name, _):
            return {name}
        case Not(operand) | Next(operand):
            return _names(operand)
        case Binary(_, left, right):
            return _names(left) | _names(right)
        case Compare(_, left, right):
            return {n.value for n in left + right if isinstance(n.value, str)}
        case _:
            return set()
