"""Two readers of one language: synthesizer and evaluator agree on the meaning of a printed
formula."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given, settings

from children import ran
from formula.test_formula import BOOLEANS, INTEGERS, formulas, states
from safenav.formula.evaluator import evaluate
from safenav.formula.syntax import Formula, to_text
from safenav.synthesis.binary import find_own_binary

State = Mapping[str, int | bool]


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
    declarations = [f"{name}:0...9" for name in INTEGERS]
    lines = ["[OUTPUT]", *BOOLEANS, *declarations, "done"]
    lines += ["[SYS_INIT]", "!done", *literals(now, "")]
    return "\n".join([*lines, "[SYS_TRANS]", "done'", *first, ""])


@pytest.fixture(scope="module")
def slugs() -> Path:
    binary = find_own_binary()
    if binary is None:
        pytest.skip("no slugs binary: run `make slugs`")
    return binary.path


def test_slugs_reads_a_formula_as_it_is_evaluated(slugs: Path) -> None:
    verdicts = set()

    @settings(max_examples=240, derandomize=True)
    @given(formulas, states, states)
    def judged(formula: Formula, now: State, then: State) -> None:
        holds = evaluate(formula, now, then)
        text = specification(formula, now, then)
        run = ran([slugs, "--realizability", "-"], input=text)
        assert run.returncode == (0 if holds else 10), f"{text}\n{run.stderr}"
        verdicts.add(holds)

    judged()
    assert verdicts == {True, False}
