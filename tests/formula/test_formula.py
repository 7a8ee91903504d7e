"""The structured-slugs expression language: reading, printing, checking, evaluating."""

import pickle
import re
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from once import beside, from_yaml
from safenav.formula import syntax
from safenav.formula.parser import FormulaError, check, parse
from safenav.formula.prefix import to_infix
from safenav.formula.syntax import Connective, Operation, evaluate, to_text

BOOLEANS = ("a", "b", "next_one", "Xs")
INTEGERS = ("x", "y")


def formulas(primes: st.SearchStrategy[bool], *larger: st.SearchStrategy[syntax.Formula]) -> Any:
    """Any formula; ``larger``: forms of it that are no operations on others."""
    integers = st.builds(syntax.Name, st.sampled_from(INTEGERS), primes)
    atoms = integers | st.builds(syntax.Number, st.integers(0, 9))
    terms = atoms | st.builds(syntax.Sum, st.lists(atoms, min_size=2, max_size=3).map(tuple))
    leaves = [
        st.builds(syntax.Name, st.sampled_from(BOOLEANS), primes),
        st.builds(syntax.Comparison, st.sampled_from(syntax.Relation), terms, terms),
        st.builds(syntax.Constant, st.booleans()),
    ]
    flat = st.sampled_from([Connective.AND, Connective.OR, Connective.XOR])
    pairs = st.sampled_from([Connective.IMPLIES, Connective.IFF])

    def joined(parts: st.SearchStrategy[syntax.Formula]) -> st.SearchStrategy[syntax.Formula]:
        return st.one_of(
            st.builds(Operation, st.just(Connective.NOT), st.tuples(parts)),
            st.builds(Operation, flat, st.lists(parts, min_size=2, max_size=3).map(tuple)),
            st.builds(Operation, pairs, st.tuples(parts, parts)),
        )

    return st.recursive(st.one_of(*leaves, *larger), joined, max_leaves=12)


unprimed = formulas(st.just(False))
following = st.builds(Operation, st.just(Connective.NEXT), st.tuples(unprimed))


@given(formulas(st.booleans(), following))
def test_a_printed_formula_reads_back_unchanged(formula: syntax.Formula) -> None:
    assert parse(to_text(formula)) == formula


@given(st.text(alphabet="abx019 '()!&|^-<>=+~/\\FGUWXnextTRUE@.é#*", max_size=40))
def test_any_text_gives_a_formula_or_an_error_with_a_position(text: str) -> None:
    column = 1
    try:
        formula = parse(text)
    except FormulaError as error:
        column = error.column
    else:
        assert parse(to_text(formula)) == formula
    assert 1 <= column <= len(text) + 1


@pytest.mark.parametrize(("alias", "plain"), from_yaml(beside(__file__, "same.yaml")))
def test_aliases_mean_the_same(alias: str, plain: str) -> None:
    assert parse(alias) == parse(plain)
    assert to_text(parse(alias)) == plain


@pytest.mark.parametrize(("text", "column", "words"), from_yaml(beside(__file__, "errors.yaml")))
def test_errors_point_at_the_position(text: str, column: int, words: str) -> None:
    with pytest.raises(FormulaError, match=f"column {column}: .*{words}") as caught:
        parse(text)
    assert caught.value.column == column
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "(" * 5000 + "a" + ")" * 5000,
        "!" * 5000 + "a",
        "a" + " -> a" * 5000,
        "(" * 90 + "a" + "".join(" -> a" * 90 + ")" for _ in range(90)),
        "(" * 90 + "a" + "".join(" & a | b)" for _ in range(90)),
    ],
    ids=["parentheses", "negations", "implications", "both", "chains"],
)
def test_deep_nesting_is_refused_with_a_message(text: str) -> None:
    with pytest.raises(FormulaError, match="too deeply"):
        parse(text)


def test_long_chains_are_flat() -> None:
    formula = parse(" | ".join(f"x = {i}" for i in range(5000)))
    assert evaluate(formula, {"x": 4999})
    assert not evaluate(formula, {"x": 5000})


VALUES = [{"a": a, "b": b} for a in (False, True) for b in (False, True)]


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("!a | b & !b", lambda a, **_: not a),
        ("a & b", lambda a, b: a and b),
        ("a | b", lambda a, b: a or b),
        ("a ^ b", lambda a, b: a is not b),
        ("a ^ b ^ !a ^ a", lambda a, b: a is b),
        ("a -> b", lambda a, b: not a or b),
        ("a <-> b", lambda a, b: a is b),
        ("next(a) & b'", lambda a, b: a and b),
    ],
)
def test_operators_have_their_truth_tables(text: str, truth: Callable[..., bool]) -> None:
    formula = parse(text)
    assert [evaluate(formula, v, v) for v in VALUES] == [truth(**v) for v in VALUES]


def test_named_constants_become_numbers() -> None:
    places = {"dock": 47}
    formula = parse("x = dock | next(!(dock < x + 1)) | x = dock'")
    assert syntax.variables(formula) == {"x", "dock"}
    resolved = syntax.resolve_constants(formula, lambda name, _: places.get(name.name))
    assert to_text(resolved) == "x = 47 | next(!(47 < x + 1)) | x = dock'"


def test_a_formula_needs_the_values_of_its_variables() -> None:
    with pytest.raises(ValueError, match="next state"):
        evaluate(parse("a'"), {"a": True})
    with pytest.raises(KeyError):
        evaluate(parse("a"), {})


DECLARED = {"flag": None, "x": (2, 9)}


@pytest.mark.parametrize(
    ("text", "first", "problems"),
    [
        ("flag & nosuch", False, {8: "unknown variable 'nosuch'"}),
        ("x & flag", False, {1: "x stands alone.*write x ="}),
        ("flag + x = 3", False, {1: "flag is Boolean"}),
        ("flag & x = 10", False, {12: "10 is outside.*from 2 to 9"}),
        ("1 != x'", False, {1: "1 is outside"}),
        ("flag -> x + 1 > 50 & x' = 9", False, {}),
        ("flag' & next(flag)", False, {}),
        ("flag' & next(flag)", True, {1: "first state only", 14: "first state only"}),
    ],
)
def test_formulas_are_checked_against_declarations(
    text: str, first: bool, problems: dict[int, str]
) -> None:
    """``first``: in an initial condition."""
    found = check(parse(text), DECLARED, next_allowed=not first)
    assert [problem.column for problem in found] == [*problems]
    for problem in found:
        assert re.search(problems[problem.column], f"{problem.found} {problem.hint}")


@pytest.mark.parametrize(("line", "infix"), from_yaml(beside(__file__, "prefix.yaml")))
def test_a_prefix_line_is_translated(line: str, infix: str) -> None:
    found = parse(to_infix(line))
    assert [evaluate(found, v) for v in VALUES] == [evaluate(parse(infix), v) for v in VALUES]


def test_a_long_chain_in_prefix_notation_stays_flat() -> None:
    """Generated files have disjunctions of hundreds of literals; nesting is limited."""
    line = "| a " * 500 + "! b"
    assert to_text(parse(to_infix(line))).count("|") == 500
