"""Truth of a formula in a state, or on a transition from a state to the next one."""

from __future__ import annotations

import operator
from collections.abc import Mapping

from safenav.formula.syntax import (
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
    Relation,
    Sum,
    Term,
    Xor,
)

State = Mapping[str, int | bool]

_RELATIONS = {
    Relation.EQUAL: operator.eq,
    Relation.UNEQUAL: operator.ne,
    Relation.LESS: operator.lt,
    Relation.AT_MOST: operator.le,
    Relation.GREATER: operator.gt,
    Relation.AT_LEAST: operator.ge,
}


def evaluate(formula: Formula, current: State, following: State | None = None) -> bool:
    """Whether the formula holds where ``current`` is the state and ``following`` the next one.

    Raises KeyError for a variable without a value, and ValueError for a next value without a
    next state.
    """
    match formula:
        case Constant(value):
            return value
        case Name():
            return bool(_term(formula, current, following))
        case Comparison(relation, left, right):
            compare = _RELATIONS[relation]
            return bool(compare(_term(left, current, following), _term(right, current, following)))
        case Not(operand):
            return not evaluate(operand, current, following)
        case Next(operand):
            return evaluate(operand, _next_state(following))
        case And(operands):
            return all(evaluate(operand, current, following) for operand in operands)
        case Or(operands):
            return any(evaluate(operand, current, following) for operand in operands)
        case Xor(operands):
            return sum(evaluate(operand, current, following) for operand in operands) % 2 == 1
        case Implies(left, right):
            return not evaluate(left, current, following) or evaluate(right, current, following)
        case Iff(left, right):
            return evaluate(left, current, following) == evaluate(right, current, following)


def _term(term: Term, current: State, following: State | None) -> int:
    match term:
        case Number(value):
            return value
        case Name(name, primed):
            return int(_next_state(following)[name] if primed else current[name])
        case Sum(terms):
            return sum(_term(part, current, following) for part in terms)


def _next_state(following: State | None) -> State:
    if following is None:
        raise ValueError("the formula refers to the next state, but there is none")
    return following
