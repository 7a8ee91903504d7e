"""Plans for requests that are due, against every joint behaviour of a team."""

import os
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from campaigns.generate.build import walled
from runtime.deadlines.every_behaviour import every_behaviour
from runtime.played import play
from safenav.runtime.deadlines.bound import BoundMoment, BoundObstacle, BoundRobot
from safenav.runtime.resolution.problem import (
    Floor,
    Member,
    OpenNeed,
    OpenObstacle,
    Problem,
    Stage,
)
from safenav.runtime.traffic.joint_search.timed import Quickest, beside
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, bits, region_mask

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 40


def crowd(seed: int) -> tuple[Problem, tuple[int, ...]]:
    """Two or three robots on one small floor, and an obstacle that some of them resolve."""
    random = Random(seed)
    rows, cols, count = random.randint(2, 3), random.randint(3, 4), random.choice((2, 3, 3))
    world = RegionMap.from_grid(walled(random, rows, cols, 0.2))
    free = sorted(world.free)
    if len(free) < count + 2:
        return crowd(seed + 100_000)
    at = random.sample(free, count + 1)
    members = []
    for k in range(count):
        graph = PoseGraph(world, random.choice((Mobility.FREE, Mobility.FREE, Mobility.HEADING)))
        skills = frozenset({"lift"} if k == 0 or random.random() < 0.5 else set())
        ticks = random.choice((1, 1, 1, 2))
        members.append(Member(f"r{k}", graph, graph.everywhere, (), True, False, skills, ticks))
    robots = min(random.choice((1, 1, 2)), sum(bool(m.capabilities) for m in members))
    regions = region_mask(random.sample(free, min(3, len(free))))
    need = OpenNeed("lift", robots, regions, together=robots > 1 and random.random() < 0.7)
    everybody = frozenset(range(count))
    gate = OpenObstacle("o@0", at[-1], (everybody,), (need,))
    apart = tuple(everybody - {i} for i in range(count))
    poses = tuple(
        random.choice([p for p in bits(m.graph.everywhere) if p % m.graph.size == at[k]])
        for k, m in enumerate(members)
    )
    return Problem(tuple(members), (gate,), apart), poses


def earliest(problem: Problem, poses: tuple[int, ...]) -> int | None:
    """The first tick in which the need is met, over all joint behaviours, turn after turn."""
    walkers = tuple(
        BoundRobot(member.graph, pose, 0, member.ticks, member.capabilities)
        for member, pose in zip(problem.members, poses, strict=True)
    )
    moment = BoundMoment(walkers, tuple(map(BoundObstacle, problem.gates)), len(poses) - 1)
    truth = every_behaviour(moment, foes=problem.conflicts)
    assert truth is not None
    (turn,) = truth.turns
    return None if turn is None else turn // len(poses)


def test_no_search_starts_if_robots_that_stay_close_the_path() -> None:
    """Each state was looked at again and again with all times: 25 s for two robots on a floor."""
    world = RegionMap.from_grid(["#########", "#...#...#", "#.......#", "#...#...#", "#########"])
    graph = PoseGraph(world, Mobility.FREE)
    skills = (frozenset({"lift"}), frozenset({"lift"}), frozenset[str]())
    members = tuple(
        Member(f"r{k}", graph, graph.everywhere, (), True, False, each, 1)
        for k, each in enumerate(skills)
    )
    gate = OpenObstacle(
        "o@0", 16, (frozenset(range(3)),), (OpenNeed("lift", 1, region_mask({16})),)
    )
    problem = Problem(members, (gate,), tuple(frozenset(range(3)) - {i} for i in range(3)))
    looked: list[int] = []
    search = Quickest(problem, (Stage(),), (10, 28, 22), 0, lambda: looked.append(1), (0, 1))
    assert search._search(1 << 30) is None
    assert len(looked) < 2


def possible(problem: Problem, plan: list[tuple[int, ...]]) -> None:
    """No two robots are in one region, none swaps with another, and all steps are steps."""
    size = problem.members[0].graph.size
    for before, after in pairwise(plan):
        assert len({pose % size for pose in after}) == len(after)
        for i, member in enumerate(problem.members):
            assert after[i] == before[i] or after[i] in member.graph.steps(before[i])
            ways = {(a % size, b % size) for a, b in zip(before, after, strict=True) if a != b}
            assert not {(b, a) for a, b in ways} & ways


@pytest.mark.parametrize("seed", range(COUNT))
def test_the_quickest_search_finds_the_earliest_joint_plan(seed: int) -> None:
    problem, poses = crowd(seed)
    truth = earliest(problem, poses)
    found = Quickest(problem, (Stage(),), poses, 0).plan()
    if found is None:
        assert truth is None
        return
    assert len(found) - 1 == truth
    possible(problem, found)
    goals = [m.graph.everywhere & -m.graph.everywhere for m in problem.members]
    floor = Floor(problem, (Stage(),), poses, tuple(m.name for m in problem.members), ("o@0",))
    possible(problem, beside(floor, found, goals))


def test_two_lifters_do_not_push_each_other_through_the_warehouse() -> None:
    """The crate stands between their places: the general search has them follow each other in a
    plan of 566 steps, which no run of 300 ticks completes."""
    text = (Path(__file__).parents[3] / "scenarios" / "warehouse_orders.yaml").read_text()
    text = text[: text.index("obstacles:\n  - ")] + (
        "obstacles:\n"
        "  - {type: debris, region: [6, 7]}\n"
        "  - {type: crate, region: [3, 7]}\n"
        "until: {rounds: 1}\n"
        "limits: {ticks: 300}\n"
    )
    outcome = play(text).outcome
    assert outcome["outcome"] == "completed"
    assert outcome["ticks"] < 120
