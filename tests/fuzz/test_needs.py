"""Promises about obstacles with several needs hold to the tick.

``SAFENAV_FUZZ=5000`` tries as many others.
"""

import os

import pytest

from fuzz.needs import defects, mission

FAILED = (0, 6, 18, 45, 66, 80, 6055, 6070, 9051, 9094, 9149, 9437, 26, 10506)
COUNT = int(os.environ.get("SAFENAV_FUZZ", "0"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "10000"))


@pytest.mark.parametrize("seed", (*FAILED, *range(FIRST, FIRST + COUNT)))
def test_an_order_that_can_be_in_time_is_done_at_its_planned_tick(seed: int) -> None:
    """Before, the robot of a later need set out late; in 66 the audit did not know which of two
    obstacles a robot served, where both are resolved from its region; in 6055 and 6070 a search
    that had used up its budget for two obstacles dropped the acts for the first one; in 9051 a slow
    robot was to set out before it had acted; in 9094 one arrived with another heading; in 9149 a
    late promise was left out of the next choice; in 9437 the audit expected slow robots of a common
    act to be elsewhere sooner; in 26 and 10506 the judge let a slow robot depart in the tick of an
    act (docs/limits.md)."""
    found = defects(mission(seed))
    if found is None and seed not in FAILED:
        pytest.skip("more states than the judge examines")
    assert found == []
