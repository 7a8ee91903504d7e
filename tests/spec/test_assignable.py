"""Goals that are assigned at runtime: what a strategy assumes of others meanwhile."""

import pytest

from safenav.spec.assignable import unless_waiting
from safenav.spec.specification import Constraint, Origin, Section


@pytest.mark.parametrize(
    ("section", "formula", "joined"),
    [
        (Section.ENV_LIVENESS, "!busy_north'", "!wait' & (!busy_north')"),
        (Section.ENV_LIVENESS, "at_b >= 20", "!wait & (at_b >= 20)"),
        (Section.ENV_TRANS, "!busy_north'", "!busy_north'"),
    ],
)
def test_others_are_out_of_the_way_when_it_may_move(
    section: Section, formula: str, joined: str
) -> None:
    constraint = Constraint(section, formula, Origin("robots", "somewhere else"))
    assert unless_waiting(constraint).formula == joined
