"""Check of what is claimed about specifications, by brute force on their explicit games."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any

import numpy as np

from oracle.game import Array, build_game, realizable, solve
from oracle.specification import (
    SECTIONS,
    Atom,
    Compare,
    Constant,
    Formula,
    Number,
    Section,
    Specification,
    Variable,
    apply,
)
from safenav.formula import syntax
from safenav.formula.parser import parse
from safenav.spec.specification import Constraint
from safenav.spec.specification import Specification as Compiled

Line = tuple[Section, Formula]
Values = Mapping[str, int]
GUARANTEES: tuple[Section, ...] = ("sys_init", "sys_trans", "sys_liveness")


def lines_of(spec: Specification) -> list[Line]:
    return [(section, formula) for section in SECTIONS for formula in spec.section(section)]


def with_lines(spec: Specification, lines: Iterable[Line]) -> Specification:
    """The variables of a specification with these lines."""
    kept = list(lines)
    sections = {name: tuple(f for s, f in kept if s == name) for name in SECTIONS}
    return replace(spec, **sections)


def realizable_together(spec: Specification) -> bool:
    """Whether one player who controls everything can satisfy all lines."""
    owned = tuple(replace(v, owner="output") for v in spec.variables)
    moved = [(section.replace("env", "sys"), formula) for section, formula in lines_of(spec)]
    return realizable(with_lines(replace(spec, variables=owned), moved))  # type: ignore[arg-type]


def never(spec: Specification) -> Specification:
    """The same with a goal that is false: realizable iff the assumptions can be broken."""
    return replace(spec, sys_liveness=(Constant(False),))


@dataclass
class Judge:
    """One specification and the set of its lines that are a core."""

    spec: Specification
    core: Sequence[Line]

    def __post_init__(self) -> None:
        self.assumed = [line for line in lines_of(self.spec) if line[0] not in GUARANTEES]
        self.promised = [line for line in lines_of(self.spec) if line[0] in GUARANTEES]
        self.part = self.with_guarantees(self.core)
        self.solution = solve(build_game(self.part))
        bits = {bit: place for place, bit in enumerate(reversed(self.spec.bits))}
        self.states = [
            {
                v.name: (v.range or (0,))[0]
                + sum((state >> bits[bit] & 1) << k for k, bit in enumerate(v.bits))
                for v in self.spec.variables
            }
            for state in range(1 << len(bits))
        ]

    def with_guarantees(self, lines: Iterable[Line]) -> Specification:
        return with_lines(self.spec, [*self.assumed, *lines])

    def fails(self) -> bool:
        return not self.solution.realizable()

    def minimal(self) -> bool:
        parts = ([*self.core[:k], *self.core[k + 1 :]] for k in range(len(self.core)))
        return all(realizable(self.with_guarantees(some)) for some in parts)

    def suffices_to_omit(self, place: int) -> bool:
        """Whether the whole is realizable without one member of the core."""
        left = list(self.promised)
        left.remove(self.core[place])
        return realizable(self.with_guarantees(left))

    def having(self, values: Values) -> Array:
        """All states with these values of some variables."""
        wanted = values.items()
        return np.array([all(state[name] == x for name, x in wanted) for state in self.states])

    def check_play(
        self,
        ending: str,
        moments: Sequence[Values],
        cycle: Sequence[Values],
        inputs: Values,
        goal: Formula | None,
    ) -> None:
        """Check that a play obeys assumptions and core, and is lost."""
        game, winning = self.solution.game, self.solution.winning
        walk = [int(self.having(values).argmax()) for values in (*moments, *cycle)]
        if ending == "no_beginning":
            allowed = self.having(inputs) & game.env_init
            assert not walk and allowed.any() and not (allowed & game.sys_init).any()
            return
        assert game.env_init[walk[0]] and game.sys_init[walk[0]], "no initial state"
        loop = [walk[len(moments)]] if cycle else []
        for a, b in zip(walk, [*walk[1:], *loop], strict=False):
            assert game.env[a, game.place[b][0]] and game.has(game.sys, a, b), (a, b)
        assert not winning[walk].any(), "a state is not lost"
        if ending == "stuck":
            assert not cycle
            wanted = game.inputs_of(self.having(inputs))
            left = np.flatnonzero(game.env[walk[-1]] & wanted)
            assert left.size and not game.sys[walk[-1], left[0]].any()
            assert not inputs or left.size == 1
            return
        turns = walk[len(moments) :]
        steps = list(zip(turns, [*turns[1:], turns[0]], strict=True))
        for fair in game.assumptions:
            assert any(game.has(fair, *step) for step in steps), "an assumption is not met"
        assert goal in self.part.sys_liveness
        met = game.guarantees[self.part.sys_liveness.index(goal)]
        assert not any(game.has(met, *step) for step in steps), "the goal is met"


OWNERS: dict[str, Any] = {"INPUT": "input", "OUTPUT": "output"}


def as_oracle(spec: Compiled) -> Specification:
    """A compiled specification as the oracle has it."""
    variables = tuple(Variable(v.name, OWNERS[v.owner], v.bounds) for v in spec.variables)
    lines = [*map(line_of, spec.constraints)]
    return with_lines(Specification(variables), lines)


def line_of(constraint: Constraint) -> Line:
    section: Any = constraint.section.value.lower()
    return section, _turned(parse(constraint.formula))


def _turned(formula: syntax.Formula) -> Formula:
    match formula:
        case syntax.Constant(value):
            return Constant(value)
        case syntax.Name(name, primed):
            return Atom(name, primed)
        case syntax.Comparison(relation, left, right):
            return Compare(relation.value, _terms(left), _terms(right))
        case syntax.Operation(operator, operands):
            parts = [*map(_turned, operands)]
            if len(parts) == 1:
                return apply(operator.value, *parts)
            return reduce(partial(apply, operator.value), parts)


def _terms(term: syntax.Term) -> tuple[Number, ...]:
    match term:
        case syntax.Number(value):
            return (Number(value),)
        case syntax.Name(name, primed):
            return (Number(name, primed),)
        case syntax.Sum(terms):
            return tuple(number for each in terms for number in _terms(each))
