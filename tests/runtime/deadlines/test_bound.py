"""The lower bound against every behaviour of a team: never above the earliest resolution."""

import pytest

from runtime.deadlines.every_behaviour import every_behaviour
from runtime.deadlines.instances import BATCHES, batch
from safenav.team.bound import NEVER, earliest, rounds_done
from safenav.world.poses import region_mask


@pytest.mark.parametrize("number", range(BATCHES))
def test_the_bound_never_exceeds_the_earliest_possible_tick(number: int) -> None:
    for asked in batch(number):
        truth = every_behaviour(asked.moment)
        assert truth is not None
        for turns, exact in zip(earliest(asked.moment), truth.turns, strict=True):
            assert turns[-1] <= (NEVER if exact is None else exact)


@pytest.mark.parametrize("number", range(BATCHES))
def test_no_round_ends_before_its_bound(number: int) -> None:
    """Nor does the whole mission, which is all rounds of each robot."""
    for asked in batch(number):
        truth = every_behaviour(asked.moment, walker=asked.walker, targets=asked.targets)
        assert truth is not None
        graph = asked.moment.walkers[asked.walker].graph
        goals = [graph.poses_on(region_mask(target)) for target in asked.targets]
        bound = rounds_done(asked.moment, asked.walker, earliest(asked.moment), goals)
        if truth.round is None:
            continue
        tick = truth.round // asked.moment.count
        assert bound <= tick
        assert bound == tick or asked.moment.opens  # nothing is in its way
