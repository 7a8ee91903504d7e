"""The bit-parallel evaluator and the counting of completions, against going through all."""

import random
from itertools import product

import pytest

from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.formula.syntax import Formula
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.verify import completions
from safenav.verify.bitparallel import Evaluator, first_row
from safenav.verify.completions import Clause, Completions, Slot

VARIABLES = (
    Variable("p", Owner.INPUT),
    Variable("x", Owner.INPUT, (2, 6)),
    Variable("q", Owner.OUTPUT),
    Variable("y", Owner.OUTPUT, (0, 5)),
    Variable("z", Owner.INPUT, (7, 7)),
)
BY_NAME = {variable.name: variable for variable in VARIABLES}
ANY = Constraint(Section.ENV_TRANS, "", Origin("", ""))


def _random_term(rng: random.Random, names: list[str]) -> str:
    parts = [rng.choice([*names, str(rng.randrange(9))]) for _ in range(rng.choice([1, 1, 2, 3]))]
    return " + ".join(parts)


def _random_formula(rng: random.Random, primes: str, depth: int = 3) -> str:
    """Random text over the variables; ``primes``: those that may be primed."""
    booleans = ["p", "q"] + [f"{n}'" for n in primes if n in "pq"]
    integers = ["x", "y", "z"] + [f"{n}'" for n in primes if n in "xyz"]
    if depth == 0 or rng.random() < 0.2:
        if rng.random() < 0.3:
            return rng.choice([*booleans, "TRUE", "FALSE"])
        relation = rng.choice(["=", "!=", "<", "<=", ">", ">="])
        return f"{_random_term(rng, integers)} {relation} {_random_term(rng, integers)}"
    if rng.random() < 0.2:
        return f"!({_random_formula(rng, primes, depth - 1)})"
    if primes and rng.random() < 0.1:
        inner = "q & x = 4" if set("qx") <= set(primes) else "p | x < 5"
        return f"next({inner})" if set("px") <= set(primes) else "TRUE"
    left, right = (_random_formula(rng, primes, depth - 1) for _ in range(2))
    return f"({left}) {rng.choice(['&', '|', '^', '->', '<->'])} ({right})"


def _ranges(names: str) -> list[range]:
    return [Slot(BY_NAME[name], False).range for name in names]


def _assignments(names: str) -> list[dict[str, int]]:
    return [dict(zip(names, values, strict=True)) for values in product(*_ranges(names))]


def test_evaluation_on_all_rows_at_once_is_evaluation_on_each() -> None:
    rng = random.Random(1)
    states = _assignments("pxqyz")
    pairs = [(rng.choice(states), rng.choice(states)) for _ in range(300)]

    def lookup(name: str, primed: bool) -> list[int]:
        values = [pair[primed][name] for pair in pairs]
        return [sum((v >> bit & 1) << row for row, v in enumerate(values)) for bit in range(3)]

    for _ in range(400):
        formula = parse(_random_formula(rng, "pxqyz"))
        expected = [r for r, (now, then) in enumerate(pairs) if evaluate(formula, now, then)]
        plane = Evaluator(len(pairs), lookup).holds(formula)
        assert [row for row in range(len(pairs)) if plane >> row & 1] == expected
        assert not expected or first_row(plane) == expected[0]


@pytest.mark.parametrize("joint", [1, 8, 1 << 12], ids=["split", "partly split", "joint"])
def test_counting_is_going_through_all(joint: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Next inputs, given a state: with and without splitting of connected variables."""
    monkeypatch.setattr(completions, "_JOINT_DOMAIN", joint)
    monkeypatch.setattr(completions, "_BLOCK_BITS", 64)
    rng = random.Random(joint)
    known = [Slot(BY_NAME[name], False) for name in "pxqyz"]
    unknown = [Slot(BY_NAME[name], True) for name in "pxz"]
    followers = _assignments("pxz")
    for _ in range(60):
        formulas = [parse(_random_formula(rng, "pxz")) for _ in range(rng.randrange(4))]
        rows = [tuple(rng.choice(r) for r in _ranges("pxqyz")) for _ in range(20)]
        counter = Completions(known, unknown, [Clause(ANY, f) for f in formulas])
        expected = [_following(row, formulas, followers) for row in rows]
        assert counter.count(rows) == [len(found) for found in expected]
        for row, found in zip(rows, expected, strict=True):
            assert list(counter.each(row)) == found


def _following(
    row: tuple[int, ...], formulas: list[Formula], followers: list[dict[str, int]]
) -> list[tuple[int, ...]]:
    state = dict(zip("pxqyz", row, strict=True))
    return [
        tuple(follower.values())
        for follower in followers
        if all(evaluate(formula, state, follower) for formula in formulas)
    ]


def test_unconnected_variables_are_not_multiplied_out() -> None:
    """Sixty Boolean inputs have 2^60 valuations; counting them takes no time."""
    inputs = [Variable(f"b{i}", Owner.INPUT) for i in range(60)]
    unknown = [Slot(variable, True) for variable in inputs]
    formulas = [Clause(ANY, parse("b0 -> b0'")), Clause(ANY, parse("b1' | b2'"))]
    counter = Completions([Slot(inputs[0], False)], unknown, formulas)
    assert counter.count([(0,), (1,)]) == [3 * 2**58, 3 * 2**57]


def test_a_large_map_is_counted_by_looking_up() -> None:
    """2,500 regions, 2,500 rows: the constraint is evaluated for each pair, once, together."""
    here = Variable("x", Owner.INPUT, (0, 2499))
    near = "x' <= x + 1 & x <= x' + 1 | x' = x + 50 | x = x' + 50"
    counter = Completions([Slot(here, False)], [Slot(here, True)], [Clause(ANY, parse(near))])
    counts = counter.count([(i,) for i in range(2500)])
    assert counts[0] == 3
    assert counts[1] == counts[2498] == 4
    assert set(counts[50:2450]) == {5}
