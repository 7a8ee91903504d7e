"""Needs that the same robots fulfil one after the other: SOLVE against every order of acts."""

import os
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import combinations
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace
from safenav.runtime.resolution import solve
from safenav.runtime.resolution.problem import OpenNeed, OpenObstacle, Problem
from safenav.runtime.resolution.proofs import TeamClosure, closure_of, refute
from safenav.runtime.resolution.solve import PoseSets, RankedStep, Solver

from campaigns.generate.build import walled
from runtime.coordination.floors import Bot, Floor
from runtime.facts import case
from runtime.played import prepared
from safenav.world.poses import bits, region_mask

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 24


def floor(seed: int) -> Floor:
    """Two or three robots that may pass each other, one or two obstacles with needs for the same
    robots; one may be unable to turn on the spot."""
    random = Random(seed)
    rows, cols = 2, random.randint(3, 4)
    grid = walled(random, rows, cols, 0.15)
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    turns = random.random() < 0.5
    bots = {
        f"r{k}": Bot(
            f"{random.choice(free)}{random.choice('nesw') if k == 0 and turns else ''}",
            [random.choice(free)],
            " ".join(action for action in "ab" if random.random() < 0.75),
            layer=str(k),
        )
        for k in range(2 if turns else random.randint(2, 3))
    }
    made = Floor(grid, bots)
    gates = []
    for number in range(random.choice((1, 2, 2))):
        robots = random.choice((1, 1, 2))
        needs = tuple(
            OpenNeed(
                random.choice("ab"),
                robots,
                region_mask(random.sample(free, min(2, len(free)))),
                robots > 1 and random.random() < 0.5,
                same=k > 0 and random.random() < 0.8,
            )
            for k in range(random.randint(2, 3))
        )
        stopped = frozenset(k for k in range(len(bots)) if random.random() < 0.6)
        place = random.choice(free)
        gates.append(OpenObstacle(f"o{number}", place, (stopped,) * len(needs), needs))
    members = [replace(m, laden=random.random() < 0.1) for m in made.problem.members]
    made.problem = Problem(tuple(members), tuple(gates), made.problem.conflicts)
    return made


Moment = tuple[tuple[int, ...], tuple[tuple[int, frozenset[int], frozenset[int]], ...]]
"""Poses; for each obstacle its next need, who has had a part in it, and who met the one before."""


def orders(problem: Problem, start: tuple[int, ...]) -> set[Moment]:
    """Every moment that some order of steps and acts leads to; nobody has to act."""
    everybody = frozenset(range(len(start)))
    first: Moment = (start, tuple((0, frozenset(), everybody) for _ in problem.gates))
    seen, queue = {first}, deque([first])
    while queue:
        for after in following(problem, queue.popleft()):
            if after not in seen:
                seen.add(after)
                queue.append(after)
    return seen


def following(problem: Problem, moment: Moment) -> Iterator[Moment]:
    poses, stages = moment
    for robot in range(len(poses)):
        for pose in steps(problem, moment, robot):
            yield (*poses[:robot], pose, *poses[robot + 1 :]), stages
    for number, (need, done, group) in enumerate(stages):
        gate = problem.gates[number]
        if need == len(gate.needs):
            continue
        wants = gate.needs[need]
        loads = not wants.same and need + 1 < len(gate.needs) and gate.needs[need + 1].same
        there = [
            robot
            for robot, pose in enumerate(poses)
            if wants.action in problem.members[robot].capabilities
            and wants.regions >> pose % problem.members[robot].graph.size & 1
            and (not wants.same or robot in group)
            and not (loads and (burden(problem, stages, robot) or problem.members[robot].laden))
        ]
        sizes = [wants.robots] if wants.together else [1]
        for who in combinations(there, sizes[0]):
            had = done | {*who}
            last = need + 1, frozenset[int](), had
            after = last if len(had) >= wants.robots else (need, had, group)
            yield poses, (*stages[:number], after, *stages[number + 1 :])


def burden(problem: Problem, stages: Iterable[Any], robot: int) -> int:
    """The loads in a robot's hands: it has taken them or had a part in that."""
    count = 0
    for gate, (need, done, group) in zip(problem.gates, stages, strict=True):
        left = gate.needs[need:]
        count += bool(left and left[0].same and robot in group)
        count += bool(len(left) > 1 and left[1].same and not left[0].same and robot in done)
    return count


def steps(problem: Problem, moment: Moment, robot: int) -> list[int]:
    graph = problem.members[robot].graph
    closed = {
        gate.region
        for gate, (need, _, _) in zip(problem.gates, moment[1], strict=True)
        if need < len(gate.needs) and robot in gate.closed_to[need]
    }
    return [pose for pose in graph.steps(moment[0][robot]) if pose % graph.size not in closed]


def goes_on(problem: Problem, moment: Moment, robot: int) -> bool:
    """Whether the robot alone gets to its target as the obstacles are now, where it may stay."""
    seen, queue = {moment[0][robot]}, deque([moment[0][robot]])
    aim, graph = problem.members[robot].targets[0], problem.members[robot].graph
    closed = {
        gate.region
        for gate, (need, _, _) in zip(problem.gates, moment[1], strict=True)
        if need < len(gate.needs) and robot in gate.closed_to[need]
    }
    while queue:
        pose = queue.popleft()
        if aim >> pose & 1 and pose % graph.size not in closed:
            return True
        here = (*moment[0][:robot], pose, *moment[0][robot + 1 :])
        for after in steps(problem, (here, moment[1]), robot):
            if after not in seen:
                seen.add(after)
                queue.append(after)
    return False


@pytest.mark.parametrize("seed", [*range(COUNT), 2136])
def test_solver_finds_exactly_the_resolutions_that_some_order_of_acts_achieves(seed: int) -> None:
    made = floor(seed)
    problem, stages = made.problem, made.problem.nothing_done
    moments = orders(problem, made.poses)
    fine = [m for m in moments if all(goes_on(problem, m, k) for k in range(len(made.poses)))]
    solver = Solver(problem)
    now = PoseSets.around(problem, made.poses, stages)
    for size in range(len(problem.gates) + 1):
        for wanted in combinations(range(len(problem.gates)), size):
            truth = any(
                all(m[1][gate][0] == len(problem.gates[gate].needs) for gate in wanted)
                for m in fine
            )
            assert solver.feasible(now, frozenset(wanted)) == truth, wanted
    if not fine:
        assert refute(now) is not None
    never = closure_of(now)
    assert isinstance(never, TeamClosure)
    for gate in never.never:  # it may be optimistic, never pessimistic
        assert all(m[1][gate][0] < len(problem.gates[gate].needs) for m in moments)
    for robot, poses in enumerate(never.reach):
        assert {m[0][robot] for m in moments} <= {*bits(poses)}


def test_the_audit_refuses_a_proof_that_ignores_partial_actions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def whole(*given: Any) -> Iterator[RankedStep]:
        return (option for option in for_gate(*given) if not option.partial)

    for_gate = solve._for_gate
    monkeypatch.setattr(solve, "_for_gate", whole)
    mission, run = prepared(case("needs/part_before_another_gets_there"))
    mission.run()
    assert run.outcome["outcome"] == "operator_needed"
    assert "truck at tag@14 is not refuted" in run.findings
