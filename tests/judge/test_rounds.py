"""Rounds of robots that stay at their last targets."""

import pytest

from safenav.judge.formulas import Pose
from safenav.judge.proofs.negatives import Goals, _met


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("in_order", [False, True])
def test_all_rounds_met_in_one_region_are_counted_together(in_order: bool, ends: bool) -> None:
    """A run of a trillion rounds is judged as fast as one of three."""
    pose: Pose = (7, None)
    own = Goals([frozenset({pose})] * 2, in_order, False, in_order and ends, [], False)
    few = [_met(own, pose, (rounds, 0)) for rounds in (1, 2, 3)]
    expected = [(0, 1), (0, 1), (0, 1)] if ends else [(0, 1), (0, 0), (0, 1)]
    assert few == (expected if in_order else [(0, 0)] * 3)
    assert _met(own, pose, (10**12, 0))[0] == 0
