"""Earliest times and several deadlines against every behaviour of a team, joint state by state."""

from collections.abc import Mapping
from random import Random

import pytest

from runtime.deadlines.every_behaviour import every_behaviour
from runtime.deadlines.instances import BATCHES, Instance, batch, slow_teams
from safenav.runtime.deadlines.bound import NEVER, BoundMoment
from safenav.runtime.deadlines.schedule import Acts, Scheduler

LATER = (0, 0, 1, 2, 3, 4, -1)
"""Turns by which an obstacle is due after its earliest one."""


@pytest.mark.parametrize("number", range(BATCHES))
def test_the_earliest_time_is_exact_but_for_collisions(number: int) -> None:
    for asked in batch(number):
        truth = every_behaviour(asked.moment)
        assert truth is not None
        asker = Scheduler(asked.moment, asked.apart, budget=20_000)
        for gate, exact in enumerate(truth.turns):
            assert asker.soonest(gate)[0] == (NEVER if exact is None else exact)
        shared = every_behaviour(asked.moment, foes=asked.foes)
        assert shared is not None
        asker = Scheduler(asked.moment, asked.foes, budget=20_000)
        for gate, exact in enumerate(shared.turns):
            assert exact is None or asker.soonest(gate)[0] <= exact


@pytest.mark.parametrize("number", range(BATCHES))
def test_a_schedule_in_time_is_found_iff_some_order_of_acts_is_in_time(number: int) -> None:
    for index, asked in enumerate(batch(number)):
        due = dues(asked, Random(f"dues {number} {index}"))
        truth = every_behaviour(asked.moment, due)
        assert truth is not None
        plan = Scheduler(asked.moment, asked.apart, budget=20_000).in_time(due)
        assert (plan is not None) == truth.kept
        if plan is not None:
            told(asked.moment, due, plan)


def dues(asked: Instance, random: Random) -> dict[int, int]:
    truth = every_behaviour(asked.moment)
    assert truth is not None
    return {
        gate: max(turn + random.choice(LATER), 0)
        for gate, turn in enumerate(truth.turns)
        if turn is not None
    }


@pytest.mark.parametrize("name", slow_teams())
def test_slow_robots_set_out_before_they_are_done(name: str) -> None:
    moment, expected, due = slow_teams()[name]
    asker = Scheduler(moment, (frozenset(),) * moment.count)
    assert [asker.soonest(gate)[0] for gate in range(len(moment.opens))] == expected
    plan = asker.in_time(due)
    assert plan is not None
    told(moment, due, plan)
    for gate in due:
        sooner = {**due, gate: due[gate] - 1}
        truth = every_behaviour(moment, sooner)
        assert truth is not None
        assert (asker.in_time(sooner) is not None) == truth.kept
    assert any(asker.in_time({**due, gate: due[gate] - 1}) is None for gate in due)


def told(moment: BoundMoment, due: Mapping[int, int], plan: Acts) -> None:
    """The acts come in the order of their turns, each obstacle's needs one after the other."""
    assert [act.turn for act in plan] == sorted(act.turn for act in plan)
    for gate, last in due.items():
        needs, one = [act.need for act in plan if act.gate == gate], moment.opens[gate]
        assert sorted(set(needs)) == list(range(one.stage.need, len(one.gate.needs)))
        assert max(act.turn for act in plan if act.gate == gate) <= last
