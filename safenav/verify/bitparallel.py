"""Truth of a formula on many rows in parallel: bit r of a Python integer is that of row r.

A row is a state, a transition, or a partial one. Each bit of a variable is a plane, an integer
with one bit for each row; connectives are single operations on planes, and comparisons and
sums are the circuits that a processor has for them. For Boolean work this beats arrays of
bytes (an operation on a million rows moves 125 kB), and it needs no import: on the hundred
nodes of a typical strategy, loading an array library would cost more than all the checking.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, reduce
from operator import and_, or_, xor

from safenav.formula import syntax

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
            case syntax.And(operands):
                planes = (self.holds(operand, primed) for operand in operands)
                return reduce(and_, planes, self.everywhere)
            case syntax.Or(operands):
                return reduce(or_, (self.holds(operand, primed) for operand in operands), 0)
            case syntax.Not(operand):
                return self.everywhere ^ self.holds(operand, primed)
            case syntax.Implies(left, right):
                return (self.everywhere ^ self.holds(left, primed)) | self.holds(right, primed)
            case syntax.Iff(left, right):
                return self.everywhere ^ self.holds(left, primed) ^ self.holds(right, primed)
            case syntax.Xor(operands):
                return reduce(xor, (self.holds(operand, primed) for operand in operands), 0)
            case syntax.Next(operand):
                return self.holds(operand, True)
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
