"""Two readers of one language: the synthesizer gives a printed formula the meaning that the
evaluator gives it."""

import random
import subprocess
from pathlib import Path

import pytest

from safenav.formula.evaluator import evaluate
from safenav.formula.printer import to_text
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
from safenav.synthesis.binary import find_own_binary

BOOLEANS = ("a", "b")
INTEGERS = {"x": (0, 3), "y": (2, 6)}
CHAINS: tuple[type[And | Or | Xor], ...] = (And, Or, Xor)
ARROWS: tuple[type[Implies | Iff], ...] = (Implies, Iff)
State = dict[str, int | bool]


def random_atom(rng: random.Random, primes: bool) -> Name | Number:
    if rng.random() < 0.4:
        return Number(rng.randrange(9))
    return Name(rng.choice(list(INTEGERS)), primes and rng.random() < 0.4)


def random_term(rng: random.Random, primes: bool) -> Term:
    if rng.random() < 0.7:
        return random_atom(rng, primes)
    return Sum(tuple(random_atom(rng, primes) for _ in range(rng.randint(2, 3))))


def random_formula(rng: random.Random, depth: int, primes: bool) -> Formula:
    kind = rng.random() if depth else 0.0
    if kind < 0.15:
        leaf = rng.random()
        if leaf < 0.1:
            return Constant(rng.random() < 0.5)
        if leaf < 0.4:
            return Name(rng.choice(BOOLEANS), primes and rng.random() < 0.4)
        relation = rng.choice(list(Relation))
        return Comparison(relation, random_term(rng, primes), random_term(rng, primes))
    if kind < 0.27:
        return Not(random_formula(rng, depth - 1, primes))
    if kind < 0.37 and primes:
        return Next(random_formula(rng, depth - 1, False))
    if kind < 0.75:
        parts = tuple(random_formula(rng, depth - 1, primes) for _ in range(rng.randint(2, 3)))
        return rng.choice(CHAINS)(parts)
    left, right = (random_formula(rng, depth - 1, primes) for _ in range(2))
    return rng.choice(ARROWS)(left, right)


def random_state(rng: random.Random) -> State:
    numbers = {name: rng.randint(*bounds) for name, bounds in INTEGERS.items()}
    return {**{name: rng.random() < 0.5 for name in BOOLEANS}, **numbers}


def literals(state: State, prime: str) -> list[str]:
    return [
        (f"{name}{prime}" if value else f"!{name}{prime}")
        if isinstance(value, bool)
        else f"{name}{prime} = {value}"
        for name, value in state.items()
    ]


def specification(formula: Formula, now: State, then: State) -> str:
    """Realizable iff the formula holds on the step from ``now`` to ``then``: the first step is
    forced to be that one, and after it (``done``) everything is allowed."""
    first = [f"done | ({condition})" for condition in (to_text(formula), *literals(then, "'"))]
    declarations = [f"{name}:{low}...{high}" for name, (low, high) in INTEGERS.items()]
    lines = ["[OUTPUT]", *BOOLEANS, *declarations, "done"]
    lines += ["[SYS_INIT]", "!done", *literals(now, "")]
    return "\n".join([*lines, "[SYS_TRANS]", "done'", *first, ""])


@pytest.fixture(scope="module")
def slugs() -> Path:
    binary = find_own_binary()
    if binary is None:
        pytest.skip("no slugs binary: run `make slugs`")
    return binary.path


@pytest.mark.parametrize("seed", range(4))
def test_slugs_reads_a_formula_as_it_is_evaluated(slugs: Path, seed: int) -> None:
    rng = random.Random(seed)
    verdicts = set()
    for _ in range(60):
        formula = random_formula(rng, 3, primes=True)
        now, then = random_state(rng), random_state(rng)
        holds = evaluate(formula, now, then)
        text = specification(formula, now, then)
        run = subprocess.run(
            [slugs, "--realizability", "-"], input=text, capture_output=True, text=True, check=False
        )
        assert run.returncode == (0 if holds else 10), f"{text}\n{run.stderr}"
        verdicts.add(holds)
    assert verdicts == {True, False}
