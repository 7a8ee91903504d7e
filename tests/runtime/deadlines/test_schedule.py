"""Earliest times and several deadlines against every behaviour of a team, joint state by state."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from random import Random

import pytest

from runtime.deadlines.test_bound import Case, State, acts, case
from safenav.runtime.deadlines.bound import NEVER, BoundMoment, earliest
from safenav.runtime.deadlines.schedule import Acts, Scheduler

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 5
MOST = 24
Way = tuple[int, int]  # the pose that a robot goes to, and the ticks that are left


def slow(seed: int) -> Case:
    """A case whose robots may take several ticks for a step."""
    asked, random = case(seed), Random(f"slow {seed}")
    walkers = tuple(
        replace(walker, ticks=random.choice((1, 1, 2, 3))) for walker in asked.moment.walkers
    )
    moment = BoundMoment(walkers, asked.moment.opens, asked.moment.now)
    return Case(moment, asked.sizes)


def behaviours(case: Case, due: Mapping[int, int], conflicts: bool) -> tuple[dict[int, int], bool]:
    """The earliest turn in which each obstacle is resolved, over all behaviours, turn after turn;
    and whether one resolves each of ``due`` by its turn (others are not followed further)."""
    moment, n = case.moment, case.moment.count
    everybody = frozenset(range(n))
    start: State = (
        tuple(walker.pose for walker in moment.walkers),
        tuple((0, frozenset[int](), everybody) for _ in moment.opens),
    )
    states: set[tuple[State, tuple[Way | None, ...]]] = {(start, (None,) * n)}
    found: dict[int, int] = {}
    for tick, robot in product(range(1, MOST), range(n)):
        turn = tick * n + robot
        after = set()
        for (poses, stages), ways in states:
            for pose, way in steps(case, robot, poses, stages, ways, conflicts):
                at = (*poses[:robot], pose, *poses[robot + 1 :])
                acted = tuple(acts(case, k, stage, robot, at) for k, stage in enumerate(stages))
                for k, (need, _, _) in enumerate(acted):
                    if need == len(moment.opens[k].parts):
                        found.setdefault(k, turn)
                if all(
                    turn < last or acted[k][0] == len(moment.opens[k].parts)
                    for k, last in due.items()
                ):
                    after.add(((at, acted), (*ways[:robot], way, *ways[robot + 1 :])))
        if not after:
            return found, False
        if after == states and robot == n - 1 and all(way is None for _, w in after for way in w):
            break
        states = after
    return found, all(last < MOST * n for last in due.values()) and all(
        k in found and found[k] <= last for k, last in due.items()
    )


def steps(
    case: Case,
    robot: int,
    poses: tuple[int, ...],
    stages: tuple[tuple[int, frozenset[int], frozenset[int]], ...],
    ways: tuple[Way | None, ...],
    conflicts: bool,
) -> list[tuple[int, Way | None]]:
    """What a robot can do in its turn: its pose after that, and what is left of its step."""
    walker, here, way = case.moment.walkers[robot], poses[robot], ways[robot]
    if way is not None:
        pose, left = way
        return [(pose, None)] if left == 1 else [(here, (pose, left - 1))]
    shut = {
        one.region
        for one, (need, _, _) in zip(case.moment.opens, stages, strict=True)
        if need < len(one.parts) and robot in one.closed[need]
    }
    size = walker.graph.size
    if conflicts:
        others = [pose for i, pose in enumerate(poses) if i != robot]
        others += [w[0] for i, w in enumerate(ways) if w is not None and i != robot]
        shut |= {pose % size for pose in others}
    found: list[tuple[int, Way | None]] = [(here, None)]
    for pose in walker.graph.steps(here):
        if pose % size not in shut:
            found.append((pose, None) if walker.ticks == 1 else (here, (pose, walker.ticks - 1)))
    return found


@pytest.mark.parametrize("seed", range(COUNT))
def test_the_earliest_time_is_exact_but_for_collisions(seed: int) -> None:
    asked, random = slow(seed), Random(f"dues {seed}")
    apart = (frozenset[int](),) * asked.moment.count
    truth, _ = behaviours(asked, {}, conflicts=False)
    same = any(part.same for one in asked.moment.opens for part in one.parts)
    for turns, gate in zip(earliest(asked.moment), range(len(asked.moment.opens)), strict=True):
        assert turns[-1] <= truth.get(gate, NEVER)  # also for robots whose steps take several ticks
    asker = Scheduler(asked.moment, apart, budget=20_000)
    found = [asker.soonest(gate)[0] for gate in range(len(asked.moment.opens))]
    for gate, turn in enumerate(found):
        exact = truth.get(gate, NEVER)
        assert turn == exact or (same and turn <= exact)
    due = {gate: random.randint(turn, turn + 6) for gate, turn in truth.items()}
    plan = asker.in_time(due)
    _, kept = behaviours(asked, due, conflicts=False)
    assert (plan is not None) == kept or (same and plan is not None)
    if plan is not None:
        told(asked, due, plan)
    together = tuple(frozenset(range(asked.moment.count)) - {i} for i in range(asked.moment.count))
    crowded, _ = behaviours(asked, {}, conflicts=True)
    shared = Scheduler(asked.moment, together, budget=20_000)
    for gate, turn in crowded.items():
        assert shared.soonest(gate)[0] <= turn


def test_a_slow_robot_sets_out_for_its_next_need_as_it_meets_the_one_before() -> None:
    """Robot 1 of three is where both obstacles want it; in turn 4 it acts for both and begins a
    step of two ticks, to where the second one takes it again, in turn 7."""
    asked = slow(200_031)
    assert [turns[-1] for turns in earliest(asked.moment)] == [4, 7]
    plan = Scheduler(asked.moment, (frozenset(),) * 3).in_time({0: 5, 1: 8})
    assert plan is not None
    told(asked, {0: 5, 1: 8}, plan)
    assert plan[-1].turn == 7


def told(asked: Case, due: Mapping[int, int], plan: Acts) -> None:
    """The acts come in the order of their turns, each obstacle's needs one after the other."""
    assert [act.turn for act in plan] == sorted(act.turn for act in plan)
    for gate, last in due.items():
        needs = [act.need for act in plan if act.gate == gate]
        assert sorted(set(needs)) == list(range(len(asked.moment.opens[gate].parts)))
        assert max(act.turn for act in plan if act.gate == gate) <= last
