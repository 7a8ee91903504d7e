"""Errors planted in the model and the loop are found twice: by the model's own properties, and by
who judges runs in time by the
world's own log."""

from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from campaigns.__main__ import drawn
from drawn import loads
from safenav.checked_trace import check_trace
from safenav.plan import order
from safenav.runtime.run import decide, loop
from safenav.team import apply as applying
from safenav.team import battery, floor
from safenav.team.state import State
from safenav.team.team import Team
from team import model
from team.playing import play as played
from team.playing import text_of
from team.test_batteries import scenario

Patch = Callable[[Any, str, Any], None]
SEEDS = range(40)
"""Boards of the model."""
LIVE = [("crowd_hidden", 1), ("tight_hidden", 1), ("labs", 3)]
"""Missions in time, in a faulty world."""


def region_left_is_free(patch: Patch) -> None:
    """The other half of a reservation, where a robot arrives, is safe by the plan's order."""

    def occupied(team: Team, state: State, among: Any = None) -> int:
        who = range(len(state.robots)) if among is None else among
        return sum(1 << at for at in {state.robots[i].next % team.size for i in who})

    patch(floor, "occupied", occupied)
    patch(decide, "reserved", floor.reserved)


def plan_has_no_order(patch: Patch) -> None:
    def hasty(_: Team, state: State, i: int) -> int | None:
        plan, robot = state.plan, state.robots[i]
        if plan is None or robot.at + 1 >= len(plan.ways[i]):
            return None
        return plan.ways[i][robot.at + 1].pose

    for each in (order, decide, model):
        patch(each, "next_step", hasty)


def goals_count_twice(patch: Patch) -> None:
    once = applying._count

    def twice(*args: Any) -> Any:
        after, met = once(*args)
        return after._replace(met=after.met + (after.met - args[1].met)), met

    patch(applying, "_count", twice)


def requests_are_forgotten(patch: Patch) -> None:
    asked = applying._asked

    def forgotten(team: Team, state: State, k: int, who: Any) -> State:
        return replace(asked(team, state, k, who), requests=state.requests)

    patch(applying, "_asked", forgotten)


def moves_are_not_characterized(patch: Patch) -> None:
    patch(loop.Run, "characterize", lambda *_: None)
    patch(order, "closed", lambda *_: frozenset())


MODEL = {
    each.__name__: each
    for each in (region_left_is_free, plan_has_no_order, goals_count_twice, requests_are_forgotten)
}
RUNS = MODEL | {moves_are_not_characterized.__name__: moves_are_not_characterized}


@pytest.fixture
def patch(monkeypatch: pytest.MonkeyPatch) -> Patch:
    return monkeypatch.setattr


@pytest.mark.parametrize("name", MODEL)
def test_properties_of_the_model_find_it(name: str, patch: Patch) -> None:
    MODEL[name](patch)
    assert any(map(fails, SEEDS))


def fails(seed: int) -> bool:
    robots = 3 + seed % 3
    try:
        model.foresee(seed, robots, Random(seed))
        model.execute(seed, robots, Random(seed))
    except (AssertionError, IndexError, KeyError):
        return True
    return False


def found(family: str, seed: int) -> list[str]:
    return drawn(family, seed, ("live", "faults"), patience=20)[1].found


@pytest.mark.parametrize(("family", "seed"), LIVE)
def test_an_honest_run_is_judged_without_a_finding(family: str, seed: int) -> None:
    assert not found(family, seed)


@pytest.mark.parametrize("name", RUNS)
def test_runs_show_it(name: str, patch: Patch) -> None:
    RUNS[name](patch)
    assert any(found(*each) for each in LIVE)


def test_a_battery_that_does_not_drain_is_found(patch: Patch) -> None:
    patch(battery.Energy, "stepped", lambda _, charge: charge)
    runs = (played(loads(scenario, seed)[1])[1] for seed in SEEDS)
    assert any("charge" in {each.rule for each in check_trace(text_of(r)).findings} for r in runs)
