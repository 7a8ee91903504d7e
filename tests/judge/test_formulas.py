"""Objectives in formulas, as the judge reads them."""

from typing import Any

import pytest

from safenav.judge.formulas import Formulas, UnreadError


@pytest.mark.parametrize(
    ("formula", "holds"),
    [
        ("region = 3", True),
        ("region' = 3", False),
        ("next(region = 4)", True),
        ("!region = 3", False),
        ("region = 3 -> region' = 4", True),
        ("region = 3 -> region' = 3", False),
        ("region = 3 -> region = 9 -> FALSE", True),
        ("region = 1 | region = 3 & region' != 3", True),
        ("region = 3 ^ region = 3 | TRUE", False),
        ("region = 3 <-> region < 7 && TRUE", True),
        ("region + 1 = region'", True),
        ("region + 1 + 1 <= region'", False),
        ("~(region >= 4) /\\ region < 4 --> X(region > 3)", True),
    ],
)
def test_formulas_agree_with_the_reference(formula: str, holds: bool) -> None:
    """At a step from 3 to 4."""
    assert Formulas({"safety": [formula]}).allows((3, None), (4, None)) is holds


@pytest.mark.parametrize(
    "body",
    [
        {"safety": ["region ="]},
        {"safety": ["region = door"]},
        {"safety": ["region = 3 region"]},
        {"safety": ["region % 2"]},
    ],
)
def test_a_formula_that_is_not_understood_is_reported(body: dict[str, Any]) -> None:
    with pytest.raises(UnreadError):
        Formulas(body)


def test_formulas_read_and_update_their_memory() -> None:
    """It may go to 5 only once it has seen 1, and forgets that there."""
    seen = "seen' <-> (seen & region' != 5 | region' = 1)"
    rules = Formulas({"memory": {"seen": "bool"}, "safety": [seen, "region' = 5 -> seen"]})
    known, at = {0}, 3
    for to, possible in ((2, {0}), (1, {1}), (4, {1}), (5, {0}), (4, {0}), (5, set[int]())):
        known, at = rules.after(known, (at, None), (to, None)), to
        assert known == possible
