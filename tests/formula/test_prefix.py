"""Lines of slugsin, in prefix notation with buffers, mean what their infix form says."""

import pytest

from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.formula.prefix import to_infix
from safenav.formula.syntax import to_text

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
