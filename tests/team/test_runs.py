"""Properties of runs on random boards, whatever the durations of steps (docs/coordination.md)."""

import os
from collections.abc import Iterator
from random import Random
from typing import Any

import pytest

from safenav.outcome import Outcome
from safenav.runtime.control import coordinate
from safenav.runtime.control.ends import End
from safenav.runtime.run.mission import Mission
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.team import state as now
from safenav.team.apply import apply
from safenav.team.floor import floor_now, stages_of
from safenav.team.state import Is
from team.boards import scenario

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 20
CLOCKS = ["lockstep", "live"]


class Watched:
    """The states of a run, each with the event that led to it."""

    def __init__(self, seed: int, clock: str) -> None:
        plan, random = scenario(seed), Random(f"speeds {seed}")
        world: SimulatedWorld | LiveSimulation = SimulatedWorld(plan)
        if clock == "live":
            speeds = {robot.name: random.uniform(0.3, 3.0) for robot in plan.robots}
            world = LiveSimulation(plan, speeds=speeds, delayed=0.2, seed=seed)
        self.states: list[tuple[now.State, now.Event, now.State]] = []
        self.run = run = Mission(plan, world=world)._run
        happens = run.happens

        def watched(event: now.Event) -> None:
            before = run.state
            happens(event)
            self.states.append((before, event, run.state))

        run.happens = watched  # type: ignore[method-assign]
        self.end: End = run.run()


@pytest.fixture(scope="module", params=CLOCKS)
def runs(request: pytest.FixtureRequest, moving_plans: None) -> list[Watched]:
    del moving_plans
    return [Watched(seed, request.param) for seed in range(COUNT)]


@pytest.fixture(scope="module")
def moving_plans() -> Iterator[None]:
    """No plan waits for itself (I3): the net that would ask for another never catches one."""
    stuck = coordinate.stuck

    def never(*arguments: Any) -> bool:
        assert not stuck(*arguments), "a plan waits for itself"
        return False

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coordinate, "stuck", never)
        yield


def test_reservations_of_rivals_are_disjoint(runs: list[Watched]) -> None:
    """I1: of each two rivals, the regions that they are in or set out for."""
    moves = 0
    for watched in runs:
        team = watched.run.team
        for _, _, state in watched.states:
            held = [reserved(team.size, robot) for robot in state.robots]
            for i, member in enumerate(team.members):
                assert not any(held[i] & held[j] for j in member.rivals)
        moves += sum(isinstance(event, now.Departed) for _, event, _ in watched.states)
    assert moves > 5 * len(runs)


def reserved(size: int, robot: now.RobotNow) -> set[int]:
    return {robot.pose % size} | (set() if robot.to is None else {robot.to % size})


def test_nobody_sets_out_for_a_known_obstacle_that_stops_it(runs: list[Watched]) -> None:
    """I2."""
    met = 0
    for watched in runs:
        team = watched.run.team
        for before, event, _ in watched.states:
            met += isinstance(event, now.Met)
            if not isinstance(event, now.Departed):
                continue
            region = event.pose % team.size
            for k, there in enumerate(before.obstacles):
                obstacle = team.obstacles[k]
                if obstacle.region != region:
                    continue
                assert not (there.state is Is.SEALED and event.robot in obstacle.blocks)
                if there.state is Is.OPEN:
                    assert event.robot not in obstacle.closed_to[there.stage.need]
    assert met > 0


def test_resolving_only_opens(runs: list[Watched]) -> None:
    """What a robot may enter grows by each part of a resolution."""
    parts = 0
    for watched in runs:
        team = watched.run.team
        for before, event, after in watched.states:
            if not isinstance(event, now.Acted) or any(t is False for _, t in event.truths):
                continue
            parts += bool(event.stages)
            floors = floor_now(team, before), floor_now(team, after)
            for i in range(len(team.members)):
                was, is_ = (
                    floor.allowed(i, stages_of(floor, state))
                    for floor, state in zip(floors, (before, after), strict=True)
                )
                assert not was & ~is_
    assert parts > 0


def test_a_state_is_the_fold_of_its_events(runs: list[Watched]) -> None:
    for watched in runs:
        team = watched.run.team
        for before, event, after in watched.states:
            if not isinstance(event, now.Gone | now.Appeared):  # these reopen requests as well
                assert apply(team, before, event) == after


def test_every_run_ends_with_a_verdict(runs: list[Watched]) -> None:
    ends = [watched.end.outcome for watched in runs]
    verdicts = {Outcome.COMPLETED, Outcome.OPERATOR_NEEDED, Outcome.UNREALIZABLE}
    assert {*ends} <= verdicts
    assert ends.count(Outcome.COMPLETED) > len(runs) / 3


def test_both_clocks_end_alike() -> None:
    """A scenario without obstacles that appear in time has the same outcome in both clocks."""
    for seed in range(COUNT):
        ends = {Watched(seed, clock).end.outcome for clock in CLOCKS}
        assert len(ends) == 1, seed
