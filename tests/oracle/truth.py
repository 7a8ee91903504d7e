"""Formulas as truth tables: one bit of a Python integer for each transition.

A state is a number whose most significant bit is the first declared variable, so that numeric
order is the lexicographic order in which strategies list states.  Bit `s << bits | t` of a table
says whether the formula holds on the transition from s to t.
"""

import operator
from collections.abc import Callable
from itertools import product

from oracle.formula import Atom, Binary, Compare, Constant, Formula, Next, Not, Number, prime
from oracle.specification import Specification, Variable

_RELATIONS: dict[str, Callable[[int, int], bool]] = {
    **{"=": operator.eq, "!=": operator.ne, "<": operator.lt},
    **{"<=": operator.le, ">": operator.gt, ">=": operator.ge},
}


class TruthTables:
    """Evaluates formulas of one specification, each distinct object once."""

    def __init__(self, specification: Specification) -> None:
        self.bits = len(specification.bits)
        self.full = (1 << (1 << (2 * self.bits))) - 1
        self._variables = {v.name: v for v in specification.variables}
        self._position = {bit: i for i, bit in enumerate(specification.bits)}
        self._memo: dict[int, tuple[Formula, int]] = {}

    def table(self, formula: Formula) -> int:
        """The truth table of a formula, memoized by identity (parsed ones share sub-formulas)."""
        known = self._memo.get(id(formula))
        if known is None:
            known = (formula, self._evaluate(formula))
            self._memo[id(formula)] = known
        return known[1]

    def conjunction(self, formulas: tuple[Formula, ...]) -> int:
        result = self.full
        for formula in formulas:
            result &= self.table(formula)
        return result

    def limits(self, variables: tuple[Variable, ...], primed: bool) -> int:
        """The transitions on which these integers are inside their declared ranges."""
        result = self.full
        for variable in variables:
            if variable.range is not None:
                low, high = variable.range
                inside = 0
                for value in range(low, high + 1):
                    inside |= self._equals(variable, value, primed)
                result &= inside
        return result

    def _evaluate(self, formula: Formula) -> int:
        match formula:
            case Constant(value):
                return self.full if value else 0
            case Atom(name, primed):
                return self._bit(name, primed)
            case Not(operand):
                return self.full ^ self.table(operand)
            case Binary(op, left, right):
                a, b = self.table(left), self.table(right)
                if op == "&":
                    return a & b
                if op == "|":
                    return a | b
                if op == "^":
                    return a ^ b
                return (self.full ^ a) | b if op == "->" else self.full ^ a ^ b
            case Compare():
                return self._compare(formula)
            case Next(operand):
                return self._evaluate(prime(operand))

    def _bit(self, name: str, primed: bool) -> int:
        """Where this bit is 1: alternating blocks, doubled up to the size of the table."""
        exponent = self.bits - 1 - self._position[name] + (0 if primed else self.bits)
        pattern = ((1 << (1 << exponent)) - 1) << (1 << exponent)
        for size in range(exponent + 1, 2 * self.bits):
            pattern |= pattern << (1 << size)
        return pattern

    def _equals(self, variable: Variable, value: int, primed: bool) -> int:
        assert variable.range is not None
        result = self.full
        for i, bit in enumerate(variable.bits):
            table = self._bit(bit, primed)
            result &= table if (value - variable.range[0]) >> i & 1 else self.full ^ table
        return result

    def _compare(self, formula: Compare) -> int:
        """By trying all values of the integers in it, also those beyond their ranges."""
        names = sorted(
            {(n.value, n.primed) for n in formula.left + formula.right if isinstance(n.value, str)}
        )
        domains = []
        for name, _ in names:
            variable = self._variables[name]
            assert variable.range is not None
            low = variable.range[0]
            domains.append(range(low, low + (1 << len(variable.bits))))
        result = 0
        for values in product(*domains):
            chosen = dict(zip(names, values, strict=True))
            left, right = _sum(formula.left, chosen), _sum(formula.right, chosen)
            if _RELATIONS[formula.relation](left, right):
                here = self.full
                for (name, primed), value in chosen.items():
                    here &= self._equals(self._variables[name], value, primed)
                result |= here
        return result


def _sum(numbers: tuple[Number, ...], values: dict[tuple[str, bool], int]) -> int:
    return sum(values[n.value, n.primed] if isinstance(n.value, str) else n.value for n in numbers)
