"""Properties of the model alone, on random boards."""

from random import Random

from hypothesis import assume, given
from hypothesis import strategies as st

from support.examples import campaign
from team import model

SEEDS = st.integers(0, 10**6)
RANDOM = st.integers(0, 2**32 - 1).map(Random)
PROPERTY = campaign(80)


@given(SEEDS, RANDOM)
@PROPERTY
def test_events_do_as_a_search_foresees(seed: int, random: Random) -> None:
    model.foresee(seed, random)


@given(SEEDS, RANDOM)
@PROPERTY
def test_a_plan_reaches_its_promise_whatever_its_steps_take(seed: int, random: Random) -> None:
    assume(model.execute(seed, random))


@given(SEEDS)
@PROPERTY
def test_resolving_only_opens(seed: int) -> None:
    team, state = model.begun(seed)
    floor = model.floor_now(team, state)
    stages = tuple(state.obstacles[k].stage for k in floor.gates)
    for g in floor.open(stages):
        after = stages
        while g in floor.open(after):
            before, after = after, floor.advanced(g, after, floor.able(g, after))
            for i in floor.robots:
                assert not floor.allowed(i, before) & ~floor.allowed(i, after)
