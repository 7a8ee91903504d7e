"""Random scenarios of one robot on a tiny map, most of them unrealizable, and their specifications
as the oracle reads them."""

from __future__ import annotations

from functools import partial, reduce
from random import Random
from typing import Any

from oracle import specification as oracle
from oracle.specification import SECTIONS, Specification, Variable
from safenav.formula import syntax
from safenav.formula.parser import parse
from safenav.spec.specification import Constraint
from safenav.spec.specification import Specification as Compiled


def mission(source: Random) -> dict[str, Any]:
    """A scenario, as data."""
    rows, cols = source.choice(((1, 5), (2, 3), (2, 4), (3, 3), (2, 2)))
    cells = rows * cols
    walls = {r for r in range(cells) if source.random() < 0.25}
    free = [r for r in range(cells) if r not in walls]
    if len(free) < 3:
        return mission(source)
    grid = [
        "".join("#" if r * cols + c in walls else "." for c in range(cols)) for r in range(rows)
    ]
    digit = source.random() < 0.3
    start, *others = source.sample(free, 3)
    robot: dict[str, Any] = {"model": "digit" if digit else "go2", "start": start}
    if digit:
        robot["heading"] = source.choice(("north", "east", "south", "west"))
    data: dict[str, Any] = {"safenav": 1, "map": {"grid": grid}, "robots": {"r": robot}}
    if digit or source.random() < 0.3:
        robot["objective"] = _targets(source, others, free)
    else:
        inputs = source.sample(("fire", "person"), source.choice((0, 1, 1, 2)))
        robot["objective"] = {"ltl": _formulas(source, inputs, free)}
        fair = source.choice(({}, {}, {"always_eventually": source.choice(("on", "off"))}))
        if inputs:
            data["inputs"] = {name: {"at": 2, **fair} for name in inputs}
    return data


def _targets(source: Random, others: list[int], free: list[int]) -> dict[str, Any]:
    kind = source.choice(("patrol", "visit", "once", "cover", "hold"))
    objective: dict[str, Any] = {kind: others[0] if kind == "hold" else others}
    if kind == "patrol" and source.random() < 0.4:
        objective["form"] = "literal"
    if source.random() < 0.3:
        objective["always"] = [f"region != {source.choice(free)}"]
    return objective


def _formulas(source: Random, inputs: list[str], free: list[int]) -> dict[str, Any]:
    def at() -> str:
        return f"region {source.choice(('=', '!='))} {source.choice(free)}"

    def event() -> str:
        name = source.choice([*inputs, "load"])
        return f"{source.choice(('', '!'))}{name}{source.choice(('', chr(39)))}"

    found: dict[str, Any] = {"memory": {"load": "bool"}, "init": source.choice(("!load", "load"))}
    if inputs and source.random() < 0.2:
        found["init"] = f"{source.choice(('', '!'))}{inputs[0]} -> {at()}"
    rules = [f"{event()} -> region' != {source.choice(free)}" for _ in range(source.randint(0, 3))]
    rules += [f"{event()} -> region' = region"] if source.random() < 0.3 else []
    rules += [f"load' <-> {event()} | {at()}"] if source.random() < 0.6 else []
    goals = [source.choice((at(), event(), f"{event()} & {at()}")) for _ in range(2)]
    return {**found, "safety": rules, "liveness": goals}


def as_oracle(spec: Compiled) -> Specification:
    """A compiled specification as the oracle has it."""
    variables = tuple(Variable(v.name, _OWNERS[v.owner], v.bounds) for v in spec.variables)
    every = {name: [c for c in spec.constraints if c.section == name.upper()] for name in SECTIONS}
    sections = {name: tuple(map(formula_of, found)) for name, found in every.items()}
    return Specification(variables, **sections)


_OWNERS: dict[str, Any] = {"INPUT": "input", "OUTPUT": "output"}


def formula_of(constraint: Constraint) -> oracle.Formula:
    return _turned(parse(constraint.formula))


def _turned(formula: syntax.Formula) -> oracle.Formula:
    match formula:
        case syntax.Constant(value):
            return oracle.Constant(value)
        case syntax.Name(name, primed):
            return oracle.Atom(name, primed)
        case syntax.Comparison(relation, left, right):
            return oracle.Compare(relation.value, _terms(left), _terms(right))
        case syntax.Operation(operator, operands):
            parts = [*map(_turned, operands)]
            if len(parts) == 1:
                return oracle.apply(operator.value, *parts)
            return reduce(partial(oracle.apply, operator.value), parts)


def _terms(term: syntax.Term) -> tuple[oracle.Number, ...]:
    match term:
        case syntax.Number(value):
            return (oracle.Number(value),)
        case syntax.Name(name, primed):
            return (oracle.Number(name, primed),)
        case syntax.Sum(terms):
            return tuple(number for each in terms for number in _terms(each))
