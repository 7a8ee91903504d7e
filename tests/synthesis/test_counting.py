"""Completions are counted without going through them; that the counts are right is what
``test_verify_random`` shows."""

from safenav.formula.parser import parse
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.verify.completions import Clause, Completions, Slot

ANY = Constraint(Section.ENV_TRANS, "", Origin("", ""))


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
