"""Properties of teams on random boards, whatever the durations of steps (docs/coordination.md):
what a search foresees against the events, plans whose steps end in any order, both clocks. That
runs keep all rules, campaigns show."""

import os
from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from drawn import loads
from runtime.worlds import Uneven
from safenav import Clock, Mission, Outcome
from safenav.plan.ask import Found, ask
from safenav.plan.order import at_end, closed, joint_now, next_step
from safenav.runtime.control import coordinate
from safenav.solve.solve import Solver, settle
from safenav.team import state as now
from safenav.team.acts import acts_on, is_reserved, standing
from safenav.team.apply import apply, initial
from safenav.team.floor import Floor, Joint
from safenav.team.known import floor_now
from safenav.team.state import Is, State
from safenav.team.team import Team, team_of
from support.draft import Data
from support.examples import campaign
from support.missions import mission

FAMILIES = ("labs", "tight_needs", "parking_hidden")
HIDDEN = ("tight_hidden", "parking_hidden", "tight_needs")
RUNS = int(os.environ.get("SAFENAV_FUZZ", "0")) or 30
MOST_EVENTS = 2_000
REPLANS = 0.1
"""How often a plan is dropped and made again while robots are on their way."""
SEEDS = st.integers(0, 10**6)
RANDOM = st.integers(0, 2**32 - 1).map(Random)
PROPERTY = campaign(80)


def drawn(number: int) -> Data:
    """A random mission. One target is held: otherwise each event counts as a round there."""
    data = mission(FAMILIES[number % len(FAMILIES)], number)
    for robot in data["robots"].values():
        ((_, targets),) = robot["objective"].items()
        if isinstance(targets, list) and len(targets) == 1:
            robot["objective"] = {"hold": targets[0]}
    return data


def begun(seed: int) -> tuple[Team, State]:
    """A team at its start, to which every obstacle is known."""
    team = team_of(loads(drawn, seed)[1])
    state = initial(team)
    for k, each in enumerate(team.obstacles):
        state = apply(team, state, now.Met(0, k, each.region))
    return team, state


def act(team: Team, state: State, i: int, *, moving: bool) -> State:
    """Robot i does all that it can where it stands."""
    stages = acts_on(team, state, standing(team, state, moving=moving), i)
    over = tuple((k, None) for k, stage in stages if team.obstacles[k].next(stage) is None)
    return apply(team, state, now.Acted(i, stages, over)) if stages else state


def acted(team: Team, state: State, *, moving: bool) -> State:
    """Let every robot act where it stands: one may do what another waits for."""
    before = None
    while before != state:
        before = state
        for i in range(len(team.members)):
            state = act(team, state, i, moving=moving)
    return state


def settled(team: Team, state: State, who: tuple[int, ...]) -> State:
    """Let every robot act; then robots ``who`` count, all of them after a resolution."""
    over, state = state.over, acted(team, state, moving=True)
    for i in who if state.over == over else range(len(team.members)):
        state = apply(team, state, now.Counted(i, at_once=True))
    return state


@given(SEEDS, RANDOM)
@PROPERTY
def test_events_have_the_effect_that_searches_predict(seed: int, random: Random) -> None:
    """Random steps, each foreseen by ``Floor.after`` and done by events, lead to the same state."""
    team, state = begun(seed)
    floor = floor_now(team, state)
    assert {*floor.gates} == {k for k, each in enumerate(state.obstacles) if each.state is Is.OPEN}
    joint = joint_now(state, floor)
    state = settled(team, state, floor.robots)
    for _ in range(random.randint(1, 12)):
        moves = [*floor.moves(joint)]
        if not moves:
            return
        i, pose = random.choice(moves)
        joint = floor.after(joint, i, pose)
        state = apply(team, state, now.Departed(i, pose, "plan"))
        state = settled(team, apply(team, state, now.Arrived(i)), (i,))
        assert joint.poses == tuple(robot.pose for robot in state.robots)
        assert joint.stages == tuple(state.obstacles[k].stage for k in floor.gates)
        assert _done(floor, joint) == _done(floor, joint_now(state, floor))


def _done(floor: Floor, joint: Joint) -> list[bool]:
    return [floor.is_done(i, joint.counts[i]) for i in floor.robots]


def planned(team: Team, state: State) -> tuple[State, Floor, frozenset[int]] | None:
    """The state with a plan for the whole mission, and what that promises; None if there is no
    plan."""
    floor = floor_now(team, state)
    joint = joint_now(state, floor)
    found = settle(Solver(floor), joint.poses, joint.stages, frozenset(), frozenset())
    answer = None if found.hopeless else ask(floor, joint, found.served, 0)
    if not isinstance(answer, Found):
        return None
    for i, memory in answer.first:
        state = apply(team, state, now.Turned(i, memory))
    return apply(team, state, now.Planned(answer.plan)), floor, frozenset(found.served)


def execute(seed: int, random: Random) -> bool:
    """Follow a plan with steps that end in any order: no two rivals are ever in one region, no
    robot enters an obstacle that is closed to it or waits forever, and the promise is kept. Return
    False if there is no plan."""
    team, state = begun(seed)
    begins = planned(team, settled(team, state, tuple(range(len(team.members)))))
    if begins is None:
        return False
    state, floor, served = begins
    loose = False
    for _ in range(MOST_EVENTS):
        if random.random() < REPLANS and (again := planned(team, state)) is not None:
            state, floor, served = again
            loose = any(robot.to is not None for robot in state.robots)
        events = [*_possible(team, state)]
        if not events:
            if floor.completed(joint_now(state, floor), served):
                return True
            before = state
            for i in range(len(team.members)):
                state = apply(team, state, now.Counted(i))
            if state == before:  # a first leg ends, or arrivals in another order counted less
                assert loose or at_end(state, range(len(team.members))), "robots wait forever"
                again = planned(team, state)
                assert again is not None, "a leg leads where no plan is found"
                state, floor, served = again
                loose = False
            continue
        event = random.choice(events)
        state = apply(team, state, event)
        if isinstance(event, now.Arrived):
            state = acted(team, state, moving=False)
            state = apply(team, state, now.Counted(event.robot))
        if random.random() < 0.3:
            state = apply(team, state, now.Counted(random.randrange(len(state.robots))))
        _require_apart(team, state)
    raise AssertionError("the plan does not end")


def _possible(team: Team, state: State) -> list[now.Arrived | now.Departed]:
    events: list[now.Arrived | now.Departed] = []
    for i, robot in enumerate(state.robots):
        if robot.to is not None:
            events.append(now.Arrived(i))
        elif (pose := next_step(team, state, i)) is not None:
            assert pose % team.size not in closed(team, state, i)
            if not is_reserved(team, state, i, pose % team.size):
                events.append(now.Departed(i, pose, "plan", due=1))
    return events


def _require_apart(team: Team, state: State) -> None:
    held = [{robot.pose % team.size, robot.next % team.size} for robot in state.robots]
    for i, member in enumerate(team.members):
        assert not any(held[i] & held[j] for j in member.rivals), "a collision"


@given(SEEDS, RANDOM)
@PROPERTY
def test_a_plan_reaches_its_final_state_for_any_durations(seed: int, random: Random) -> None:
    assume(execute(seed, random))


@given(SEEDS)
@PROPERTY
def test_resolving_an_obstacle_only_opens_paths(seed: int) -> None:
    team, state = begun(seed)
    floor = floor_now(team, state)
    stages = tuple(state.obstacles[k].stage for k in floor.gates)
    for g in floor.open(stages):
        after = stages
        while g in floor.open(after):
            before, after = after, floor.advanced(g, after, floor.able(g, after))
            for i in floor.robots:
                assert not floor.allowed(i, before) & ~floor.allowed(i, after)


@pytest.mark.parametrize("seed", range(RUNS))
def test_both_clocks_end_alike_and_no_plan_waits_for_itself(
    seed: int, played: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No plan is replaced because its robots wait for each other."""
    stuck = coordinate.stuck

    def never(*arguments: Any) -> bool:
        assert not stuck(*arguments), "a plan waits for itself"
        return False

    monkeypatch.setattr(coordinate, "stuck", never)
    _, scenario = loads(lambda number: mission(HIDDEN[seed % 3], number), seed)
    random = Random(f"speeds {seed}")
    speeds = {robot.name: random.uniform(0.3, 3.0) for robot in scenario.robots}
    live = replace(scenario, clock=Clock.LIVE)
    world = Uneven(live, speeds=speeds, delayed=0.2, seed=seed)
    ends = {Mission(scenario).run().outcome, Mission(live, world=world).run().outcome}
    assert len(ends) == 1 and ends < {
        Outcome.COMPLETED,
        Outcome.OPERATOR_NEEDED,
        Outcome.UNREALIZABLE,
    }
    played()
