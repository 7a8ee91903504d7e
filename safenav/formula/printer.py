"""Formulas as text, with as few parentheses as the precedences need.

``parse(to_text(f)) == f``: a group that could be flattened keeps its parentheses.
"""

from __future__ import annotations

from safenav.formula.syntax import (
    PRECEDENCE,
    And,
    Comparison,
    Constant,
    Formula,
    Iff,
    Implies,
    Name,
    Next,
    Not,
    Number,
    Or,
    Sum,
    Term,
    Xor,
)

_ATOM = 7
_SYMBOL = {Xor: " ^ ", Or: " | ", And: " & ", Implies: " -> ", Iff: " <-> "}


def to_text(formula: Formula) -> str:
    """Return the formula in structured slugs, on one line."""
    match formula:
        case Constant(value):
            return "TRUE" if value else "FALSE"
        case Name():
            return _term(formula)
        case Comparison(relation, left, right):
            return f"{_term(left)} {relation.value} {_term(right)}"
        case Not(operand):
            return "!" + _not_operand(operand)
        case Next(operand):
            return f"next({to_text(operand)})"
        case And(operands) | Or(operands) | Xor(operands):
            rank = PRECEDENCE[type(formula)]
            return _SYMBOL[type(formula)].join(_within(operand, rank + 1) for operand in operands)
        case Implies(left, right) | Iff(left, right):
            rank = PRECEDENCE[type(formula)]
            return _within(left, rank) + _SYMBOL[type(formula)] + _within(right, rank + 1)


def _within(formula: Formula, lowest: int) -> str:
    """Return the formula, in parentheses if its precedence is below ``lowest``."""
    text = to_text(formula)
    return text if PRECEDENCE.get(type(formula), _ATOM) >= lowest else f"({text})"


def _not_operand(operand: Formula) -> str:
    # "!x = 3" would parse as meant, but a reader should not have to know that.
    if isinstance(operand, Comparison):
        return f"({to_text(operand)})"
    return _within(operand, PRECEDENCE[Not])


def _term(term: Term) -> str:
    match term:
        case Number(value):
            return str(value)
        case Name(name, primed):
            return name + "'" if primed else name
        case Sum(terms):
            return " + ".join(_term(part) for part in terms)
