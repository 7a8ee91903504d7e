"""The structured-slugs expression language: read and printed by scenarios, checked against
declarations, evaluated by the verifier of strategies."""

import json
import pickle
import re
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from once import beside, from_yaml
from oracle.specification import Atom, Compare, Constant, Formula, Number, apply
from oracle.text import infix, truth
from safenav import (
    InputError,
    SafenavError,
    Strategy,
    first_failure,
    load_scenario_text,
    read_specification,
)

BOOLEANS = ("a", "b", "c", "d", "flag", "next_one", "Xs")
MEMORY: dict[str, Any] = {**dict.fromkeys(BOOLEANS, "bool"), "x": [2, 9], "y": [0, 9]}
OBJECTIVE = {"memory": MEMORY, "liveness": ["region = 0"]}


def read(formula: str, part: str = "safety") -> str:
    """Return a formula of a robot as its scenario has it. Errors are in columns of the formula."""
    ltl = json.dumps(OBJECTIVE | {part: [formula]}, ensure_ascii=False)
    line = f"robots: {{ann: {{model: quadcopter, start: 0, objective: {{ltl: {ltl}}}}}}}"
    try:
        scenario = load_scenario_text(f'safenav: 1\nmap: {{grid: [".."]}}\n{line}')
    except InputError as error:
        begin = line.index(f'"{part}": ["') + len(part) + 6
        found = (each._replace(column=each.column - begin) for each in error.diagnostics)
        raise InputError([*found]) from None
    (printed,) = getattr(scenario.robots[0].objective, part)
    return str(printed)


def holds(formula: str, **values: int) -> bool:
    """Whether a formula holds, at the start and on a step, where variables keep their values."""
    declared = "\n".join(name if name in "ab" else f"{name}:0...1" for name in values)
    first = "" if re.search(r"next|'", formula) else f"[SYS_INIT]\n{formula}\n"
    specification = read_specification(f"[OUTPUT]\n{declared}\n{first}[SYS_TRANS]\n{formula}\n")
    names = [name if name in "ab" else f"{name}@0.0.1" for name in values]
    node = {"rank": 0, "state": [*values.values()], "trans": [0]}
    data = {"version": 0, "slugs": "1", "variables": names, "nodes": {"0": node}}
    strategy = Strategy.parse(json.dumps(data).encode(), specification)
    return first_failure(specification, strategy) is None


def formulas(primes: st.SearchStrategy[bool], *larger: st.SearchStrategy[Formula]) -> Any:
    """Any formula; ``larger``: forms of it that are no operations on others."""
    names = st.builds(Number, st.sampled_from(("x", "y")), primes)
    sums = st.lists(names | st.builds(Number, st.integers(2, 9)), min_size=1, max_size=3).map(tuple)
    relations = st.sampled_from(("=", "!=", "<", "<=", ">", ">="))
    leaves = [
        st.builds(Atom, st.sampled_from(BOOLEANS), primes),
        st.builds(Compare, relations, names.map(lambda name: (name,)), sums),
        st.builds(Constant, st.booleans()),
    ]
    signs = st.sampled_from(("&", "|", "^", "->", "<->"))
    return st.recursive(
        st.one_of(*leaves, *larger),
        lambda part: st.builds(apply, st.just("!"), part) | st.builds(apply, signs, part, part),
        max_leaves=12,
    )


following = st.builds(apply, st.just("next"), formulas(st.just(False)))


@given(formulas(st.booleans(), following), st.integers(0, 10**6))
def test_printing_keeps_the_meaning_of_a_formula(formula: Formula, seed: int) -> None:
    random = Random(seed)
    printed = read(infix(formula, random))
    assert read(printed) == printed
    one, other = truth(formula), truth(printed)
    for _ in range(8):
        now, then = ({name: random.randint(0, 1) for name in BOOLEANS} for _ in range(2))
        for state in (now, then):
            state.update(x=random.randint(2, 9), y=random.randint(2, 9))
        assert one(now, then) == other(now, then)


@given(st.text(alphabet="abx019 '()!&|^-<>=+~/\\FGUWXnextTRUE@.é#*", min_size=1, max_size=40))
def test_any_text_gives_a_formula_or_an_error_with_a_position(text: str) -> None:
    try:
        printed = read(text)
    except InputError as error:
        for each in error.diagnostics:
            assert each.found and 0 <= each.column < len(json.dumps(text, ensure_ascii=False))
    else:
        assert read(printed) == printed


@pytest.mark.parametrize(("alias", "plain"), from_yaml(beside(__file__, "same.yaml")))
def test_an_alias_of_an_operator_means_that_operator(alias: str, plain: str) -> None:
    assert read(alias) == read(plain) == plain


ERRORS = [
    *from_yaml(beside(__file__, "errors.yaml")),
    ["(" * 5000 + "a" + ")" * 5000, None, "nested too deep"],
    ["!" * 5000 + "a", None, "nested too deep"],
    ["!" * 101 + "a", None, "nested too deep"],
    ["a" + " -> a" * 5000, None, "nested too deep"],
    ["(" * 90 + "a" + "".join(" -> a" * 90 + ")" for _ in range(90)), None, "nested too deep"],
    ["(" * 90 + "a" + "".join(" & a | b)" for _ in range(90)), None, "nested too deep"],
]


@pytest.mark.parametrize(("text", "column", "words"), ERRORS, ids=[each[0][:20] for each in ERRORS])
def test_errors_state_their_column(text: str, column: int | None, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read(text)
    (found,) = caught.value.diagnostics
    assert column in (None, found.column) and re.search(words, f"{found.found} {found.hint}")


@pytest.mark.parametrize(
    ("text", "first", "problems"),
    [
        ("flag & nosuch", False, {8: "unknown variable 'nosuch'"}),
        ("x & flag", False, {1: "x stands alone.*write x ="}),
        ("flag + x = 3", False, {1: "flag is Boolean"}),
        ("flag & x = 10", False, {12: "10 is outside.*from 2 to 9"}),
        ("1 != x'", False, {1: "1 is outside"}),
        ("flag -> x + 1 > 50 & x' = 9", False, {}),
        ("flag' & next(!flag)", False, {}),
        ("flag' & next(flag)", True, {1: "first state only", 14: "first state only"}),
    ],
)
def test_formulas_are_checked_against_declarations(
    text: str, first: bool, problems: dict[int, str]
) -> None:
    """``first``: in an initial condition."""
    if not problems:
        assert read(text) == text
        return
    with pytest.raises(InputError) as caught:
        read(text, "init" if first else "safety")
    found = caught.value.diagnostics
    assert [problem.column for problem in found] == [*problems]
    for problem in found:
        assert re.search(problems[problem.column], f"{problem.found} {problem.hint}")


VALUES = [{"a": a, "b": b} for a in (0, 1) for b in (0, 1)]


@pytest.mark.parametrize(("text", "expected"), from_yaml(beside(__file__, "truth.yaml")))
def test_operators_have_their_truth_tables(text: str, expected: str) -> None:
    wanted = [bool(eval(expected, dict(values))) for values in VALUES]
    assert [holds(text, **values) for values in VALUES] == wanted
    assert [truth(text)(values, values) for values in VALUES] == wanted


def test_a_chain_of_thousands_of_operands_is_not_too_deep() -> None:
    """Generated files have disjunctions of hundreds of literals; nesting is limited."""
    chain = " | ".join(["x = 1"] * 5000)
    assert holds(chain, x=1) and not holds(chain, x=0)
    assert holds("| a " * 500 + "! b", a=0, b=0) and holds("! " * 100 + "a", a=1)


@pytest.mark.parametrize(("line", "infix"), from_yaml(beside(__file__, "prefix.yaml")))
def test_a_prefix_line_of_slugsin_becomes_infix(line: str, infix: str) -> None:
    assert [holds(line, **v) for v in VALUES] == [truth(infix)(v, v) for v in VALUES]


@pytest.mark.parametrize("formula", ["a &", "& a", "& a b a", "$ 1 a b", "! " * 5000 + "a"])
def test_errors_can_be_sent_between_processes(formula: str) -> None:
    with pytest.raises(SafenavError, match=r"expected|nested too deep") as caught:
        holds(formula, a=1, b=1)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
