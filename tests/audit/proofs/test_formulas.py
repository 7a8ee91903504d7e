"""Objectives in formulas, as the audit reads them."""

from typing import Any

import pytest

from audit.proofs.test_proofs import FREE, corridor
from safenav.audit.formulas import Formulas, Texts
from safenav.audit.language import RefusedError


@pytest.mark.parametrize(
    ("formula", "before", "after", "holds"),
    [
        ("region = 3", 3, 4, True),
        ("region' = 3", 3, 4, False),
        ("next(region = 4)", 3, 4, True),
        ("!region = 3", 3, 4, False),
        ("region = 3 -> region' = 4", 3, 4, True),
        ("region = 3 -> region' = 3", 3, 4, False),
        ("region = 3 -> region = 9 -> FALSE", 3, 4, True),
        ("region = 1 | region = 3 & region' != 3", 3, 4, True),
        ("region = 3 ^ region = 3 | TRUE", 3, 4, False),
        ("region = 3 <-> region < 7 && TRUE", 3, 4, True),
        ("region + 1 = region'", 3, 4, True),
        ("region + 1 + 1 <= region'", 3, 4, False),
        ("~(region >= 4) /\\ region < 4 --> X(region > 3)", 3, 4, True),
    ],
)
def test_formulas_mean_what_the_reference_says(
    formula: str, before: int, after: int, holds: bool
) -> None:
    read = Formulas(Texts({"safety": formula}))
    assert read.allows((before, None), (after, None)) is holds


@pytest.mark.parametrize(
    "body",
    [
        {"safety": "region ="},
        {"safety": "region = door"},
        {"safety": "region = 3 region"},
        {"safety": ["region % 2"]},
        {"memory": {"seen": "text"}},
        {"memory": {"far": [0, 99]}},
        {"liveness": 7},
    ],
)
def test_a_formula_that_is_not_understood_is_reported(body: dict[str, Any]) -> None:
    with pytest.raises(RefusedError):
        Formulas(Texts(body))


def live(heading: str | None = None, **body: Any) -> set[int]:
    formulas, steps = Formulas(Texts(body)), corridor(heading)
    kept = {a: [b for b in to if formulas.allows(a, b)] for a, to in steps.items()}
    return {pose[0] for pose, _ in formulas.live(frozenset(steps), kept)}


def test_goals_are_met_infinitely_often() -> None:
    assert live(liveness=["region = 1", "region = 5"]) == set(FREE)


def test_a_region_that_is_never_entered_parts_the_corridor() -> None:
    assert live(safety="region' != 3", liveness=["region = 5"]) == {3, 4, 5}


def test_formulas_read_and_update_their_memory() -> None:
    """It may go to 5 only once it has seen 1, and forgets that there."""
    seen = "seen' <-> (seen & region' != 5 | region' = 1)"
    rule = [seen, "region' = 5 -> seen"]
    assert live(memory={"seen": "bool"}, safety=rule, liveness="region = 5") == set(FREE)
    never = [*rule, "region' != 1"]
    assert live(memory={"seen": "bool"}, safety=never, liveness="region = 5") == set()


def test_a_robot_that_must_not_stay_cannot_end_in_a_dead_end() -> None:
    moving = "region' != region"
    assert live(heading="east", safety=moving, liveness="TRUE") == set()
    assert live(safety=moving, liveness="TRUE") == set(FREE)
