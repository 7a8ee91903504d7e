"""Truth of a formula in a state, or on a transition from a state to the next one."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping

from safenav.formula import syntax

State = Mapping[str, int | bool]
Predicate = Callable[[State, State | None], bool]

_RELATIONS = {
    syntax.Relation.EQUAL: operator.eq,
    syntax.Relation.UNEQUAL: operator.ne,
    syntax.Relation.LESS: operator.lt,
    syntax.Relation.AT_MOST: operator.le,
    syntax.Relation.GREATER: operator.gt,
    syntax.Relation.AT_LEAST: operator.ge,
}


def evaluate(formula: syntax.Formula, current: State, following: State | None = None) -> bool:
    """Whether the formula holds where ``current`` is the state and ``following`` the next one.

    Raises KeyError for a variable without a value, and ValueError for a next value without a
    next state.
    """
    return predicate(formula)(current, following)


def predicate(formula: syntax.Formula) -> Predicate:
    """The formula as a function of a state and the next one, for many of them; see ``evaluate``."""
    match formula:
        case syntax.Constant(value):
            return lambda _, __: value
        case syntax.Name():
            term = _term(formula)
            return lambda now, then: bool(term(now, then))
        case syntax.Comparison(relation, left, right):
            compare, low, high = _RELATIONS[relation], _term(left), _term(right)
            return lambda now, then: compare(low(now, then), high(now, then))
        case syntax.Not(operand):
            part = predicate(operand)
            return lambda now, then: not part(now, then)
        case syntax.Next(operand):
            part = predicate(operand)
            return lambda _, then: part(_next_state(then), then)
        case syntax.And(operands):
            parts = [predicate(operand) for operand in operands]
            return lambda now, then: all(part(now, then) for part in parts)
        case syntax.Or(operands):
            return _some_of(operands)
        case syntax.Xor(operands):
            parts = [predicate(operand) for operand in operands]
            return lambda now, then: sum(part(now, then) for part in parts) % 2 == 1
        case syntax.Implies(left, right):
            one, other = predicate(left), predicate(right)
            return lambda now, then: not one(now, then) or other(now, then)
        case syntax.Iff(left, right):
            one, other = predicate(left), predicate(right)
            return lambda now, then: one(now, then) == other(now, then)


def _some_of(operands: tuple[syntax.Formula, ...]) -> Predicate:
    """Return a disjunction. One over values of a single variable is a look-up in a set."""
    name, values = None, set[int]()
    for operand in operands:
        match operand:
            case syntax.Comparison(
                syntax.Relation.EQUAL, syntax.Name() as left, syntax.Number(value)
            ) if left == (name or left):
                name = left
                values.add(value)
            case _:
                parts = [predicate(operand) for operand in operands]
                return lambda now, then: any(part(now, then) for part in parts)
    assert name is not None
    term = _term(name)
    return lambda now, then: term(now, then) in values


def _term(term: syntax.Term) -> Callable[[State, State | None], int]:
    match term:
        case syntax.Number(value):
            return lambda _, __: value
        case syntax.Name(name, True):
            return lambda _, then: int(_next_state(then)[name])
        case syntax.Name(name):
            return lambda now, _: int(now[name])
        case syntax.Sum(terms):
            parts = [_term(part) for part in terms]
            return lambda now, then: sum(part(now, then) for part in parts)


def _next_state(following: State | None) -> State:
    if following is None:
        raise ValueError("the formula refers to the next state, but there is none")
    return following
