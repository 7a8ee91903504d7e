"""The structured-slugs expression language: reading, printing, checking, evaluating."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from once import beside, from_yaml
from safenav.formula import syntax
from safenav.formula.parser import MAX_DEPTH, FormulaError, check, parse, to_infix
from safenav.formula.syntax import Connective, Operation, evaluate, to_text

BOOLEANS = ("a", "b", "next_one", "Xs")
INTEGERS = ("x", "y")

booleans = st.builds(syntax.Name, st.sampled_from(BOOLEANS), st.booleans())
atoms = st.builds(syntax.Name, st.sampled_from(INTEGERS), st.booleans()) | st.builds(
    syntax.Number, st.integers(0, 9)
)
sums = st.builds(lambda parts: syntax.Sum(tuple(parts)), st.lists(atoms, min_size=2, max_size=3))
comparisons = st.builds(
    syntax.Comparison, st.sampled_from(syntax.Relation), atoms | sums, atoms | sums
)
leaves = booleans | comparisons | st.builds(syntax.Constant, st.booleans())


def _unprimed(formula: syntax.Formula) -> syntax.Formula:
    """The formula as it may stand inside next(...)."""
    match formula:
        case syntax.Name(name):
            return syntax.Name(name)
        case syntax.Comparison(relation, left, right):
            return syntax.Comparison(relation, _unprimed_term(left), _unprimed_term(right))
        case Operation(Connective.NEXT, (operand,)):
            return _unprimed(operand)
        case Operation(operator, operands):
            return Operation(operator, tuple(map(_unprimed, operands)))
    return formula


def _unprimed_term(term: syntax.Term) -> syntax.Term:
    if isinstance(term, syntax.Sum):
        return syntax.Sum(
            tuple(syntax.Name(t.name) if isinstance(t, syntax.Name) else t for t in term.terms)
        )
    return syntax.Name(term.name) if isinstance(term, syntax.Name) else term


def _larger(children: st.SearchStrategy[syntax.Formula]) -> st.SearchStrategy[syntax.Formula]:
    one, two = children.map(lambda each: (each,)), st.tuples(children, children)
    several = st.lists(children, min_size=2, max_size=3).map(tuple)
    return st.one_of(
        st.builds(Operation, st.just(Connective.NOT), one),
        st.builds(Operation, st.just(Connective.NEXT), one.map(lambda each: (_unprimed(*each),))),
        st.builds(
            Operation, st.sampled_from([Connective.AND, Connective.OR, Connective.XOR]), several
        ),
        st.builds(Operation, st.sampled_from([Connective.IMPLIES, Connective.IFF]), two),
    )


formulas = st.recursive(leaves, _larger, max_leaves=12)


@given(formulas)
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


@pytest.mark.parametrize(
    ("alias", "plain"),
    [
        ("(a | (b & c)) ^ d", "a | b & c ^ d"),
        ("(a -> b) -> c <-> (!d)", "a -> b -> c <-> !d"),
        ("(x) + 1 <= y'", "x + 1 <= y'"),
        ("a && b /\\ c", "a & b & c"),
        ("a || b \\/ c", "a | b | c"),
        ("~a", "!a"),
        ("a --> b", "a -> b"),
        ("a <--> b", "a <-> b"),
        ("X(a)", "next(a)"),
    ],
)
def test_aliases_mean_the_same(alias: str, plain: str) -> None:
    assert parse(alias) == parse(plain)
    assert to_text(parse(alias)) == plain


@pytest.mark.parametrize(("text", "column", "words"), from_yaml(beside(__file__, "errors.yaml")))
def test_errors_point_at_the_position(text: str, column: int, words: str) -> None:
    with pytest.raises(FormulaError, match=f"column {column}: .*{words}") as caught:
        parse(text)
    assert caught.value.column == column


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
def test_deep_nesting_is_refused_politely(text: str) -> None:
    with pytest.raises(FormulaError, match=f"more than {MAX_DEPTH} deep"):
        parse(text)


def test_long_chains_are_flat() -> None:
    formula = parse(" | ".join(f"x = {i}" for i in range(5000)))
    assert evaluate(formula, {"x": 4999})
    assert not evaluate(formula, {"x": 5000})


@pytest.mark.parametrize("a", [False, True])
@pytest.mark.parametrize("b", [False, True])
def test_operators_have_their_truth_tables(a: bool, b: bool) -> None:
    truth = {
        "!a": not a,
        "a & b": a and b,
        "a | b": a or b,
        "a ^ b": a is not b,
        "a ^ b ^ !a ^ a": a is b,
        "a -> b": not a or b,
        "a <-> b": a is b,
        "next(a) & b'": a and b,
    }
    state = {"a": a, "b": b}
    assert {text: evaluate(parse(text), state, state) for text in truth} == truth


def test_variables_of_a_formula() -> None:
    assert syntax.variables(parse("a & (x + y' < 3) -> next(b)")) == {"a", "x", "y", "b"}


def test_named_constants_become_numbers() -> None:
    places = {"dock": 47}
    formula = parse("x = dock | next(!(dock < x + 1)) | x = dock'")
    resolved = syntax.resolve_constants(formula, lambda name, _: places.get(name.name))
    assert to_text(resolved) == "x = 47 | next(!(47 < x + 1)) | x = dock'"


def test_next_values_need_a_next_state() -> None:
    with pytest.raises(ValueError, match="next state"):
        evaluate(parse("a'"), {"a": True})
    with pytest.raises(KeyError):
        evaluate(parse("a"), {})


DECLARED = {"flag": None, "x": (2, 9)}


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [
        ("flag & nosuch", 8, "unknown variable 'nosuch'"),
        ("x & flag", 1, "x stands alone.*write x ="),
        ("flag + x = 3", 1, "flag is Boolean"),
        ("flag & x = 10", 12, "10 is outside.*from 2 to 9"),
        ("1 != x'", 1, "1 is outside"),
    ],
)
def test_checks_against_declarations(text: str, column: int, words: str) -> None:
    (problem,) = check(parse(text), DECLARED)
    assert problem.column == column
    assert re.search(words, f"{problem.found} {problem.hint}")


def test_no_next_value_in_an_initial_condition() -> None:
    assert not check(parse("flag' & next(flag)"), DECLARED)
    primed, following = check(parse("flag' & next(flag)"), DECLARED, next_allowed=False)
    assert primed.column == 1
    assert following.column == 14
    assert "first state only" in primed.hint
    assert "first state only" in following.hint


def test_a_sound_formula_has_no_error() -> None:
    assert check(parse("flag -> x + 1 > 50 & x' = 9"), DECLARED) == ()


VALUES = [{"a": a, "b": b} for a in (False, True) for b in (False, True)]


@pytest.mark.parametrize(
    ("line", "infix"),
    [
        ("! a", "!a"),
        ("& a | b a", "a & (b | a)"),
        ("^ a ^ b 1", "a ^ b ^ TRUE"),
        ("| & a b ! a", "(a & b) | !a"),
        ("$ 2 ^ a b & ? 0 a", "(a ^ b) & a"),
        ("$ 3 a ! ? 0 | ? 1 b", "!a | b"),
        ("$ 3 a b & ? 0 ? 1", "a & b"),
        ("& $ 1 a $ 2 b ! ? 0", "a & !b"),
        ("| 0 b", "b"),
        ("! | a b", "!(a | b)"),
        ("1", "TRUE"),
        ("! a & b", "!a & b"),
        ("!(a | b)", "!(a | b)"),
    ],
)
def test_a_prefix_line_is_translated(line: str, infix: str) -> None:
    found = parse(to_infix(line))
    assert [evaluate(found, v) for v in VALUES] == [evaluate(parse(infix), v) for v in VALUES]


def test_a_long_chain_in_prefix_notation_stays_flat() -> None:
    """Generated files have disjunctions of hundreds of literals; nesting is limited."""
    line = "| a " * 500 + "! b"
    assert to_text(parse(to_infix(line))).count("|") == 500
