"""SOLVE, duties and proofs on small floors: who can do what, in which order, and what is lost."""

from dataclasses import dataclass

import pytest

from runtime.coordination.floors import Block, Bot, Floor
from safenav.runtime.duties.settlement import Settlement, settle
from safenav.runtime.resolution.proofs import TeamClosure, closure_of, refute
from safenav.runtime.resolution.solve import Solver

HALL = ["############", "#..........#", "############"]


def settled(floor: Floor, *requests: int) -> Settlement:
    solver = Solver(floor.problem)
    order = requests or tuple(range(len(floor.problem.gates)))
    return settle(solver, floor.poses, floor.problem.nothing_done, order, {})


def door(region: int) -> Block:
    return Block(region, [("push", 1, [region], False)])


def fog(region: int, *at: int) -> Block:
    return Block(region, [("sense", 1, at, False)])


@dataclass(frozen=True)
class Case:
    claim: str
    floor: Floor
    duties: dict[int, int]


CASES = [
    Case(
        "the capable robot that is there first serves",
        Floor(
            HALL,
            {"r": Bot("13", [22]), "a": Bot("22", [22], "push"), "b": Bot("14", [14], "push")},
            [door(17)],
        ),
        {2: 0},
    ),
    Case(
        "ticks count, not steps",
        Floor(
            HALL,
            {
                "r": Bot("13", [22]),
                "slow": Bot("15", [15], "push", ticks=4),
                "quick": Bot("21", [21], "push"),
            },
            [door(17)],
        ),
        {2: 0},
    ),
    Case(
        "what opens the way comes first, its successor is reserved",
        Floor(
            HALL,
            {"r": Bot("13", [22], "push"), "d": Bot("14", [14], "sense")},
            [fog(15, 14, 20), door(20)],
        ),
        {1: 0},
    ),
    Case(
        "independent obstacles are served at the same time",
        Floor(
            HALL,
            {
                "a": Bot("13", [13], "push"),
                "b": Bot("22", [22], "sense"),
                "c": Bot("17", [13, 22], layer="air"),
            },
            [door(15), fog(19, 20)],
        ),
        {0: 0, 1: 1},
    ),
    Case(
        "two lift together, each on a region of its own",
        Floor(
            HALL,
            {"a": Bot("13", [13], "lift"), "b": Bot("14", [14], "lift"), "c": Bot("22", [22, 13])},
            [Block(17, [("lift", 2, [16, 15], True)])],
        ),
        {0: 0, 1: 0},
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.claim)
def test_duties(case: Case) -> None:
    found = settled(case.floor)
    assert found.proof is None
    assert {robot: duty.gate for robot, duty in found.duties.items()} == case.duties


def test_an_obstacle_that_nobody_reaches_now_is_served_once_another_is_gone() -> None:
    """One corridor: fog at 15 can be sensed from 14 or 21, the door at 20 is behind it."""
    floor = Floor(
        HALL,
        {"r": Bot("13", [22], "push"), "d": Bot("22", [22], "sense")},
        [fog(15, 14, 21), door(20)],
    )
    found = settled(floor, 0, 1)
    assert found.served == (0, 1)
    assert {robot: duty.gate for robot, duty in found.duties.items()} == {1: 0}
    assert [step.gate for step in found.plan] == [0, 1]


def test_nobody_with_the_action_gives_a_closure() -> None:
    floor = Floor(HALL, {"r": Bot("13", [22])}, [door(17)])
    found = settled(floor)
    assert isinstance(found.proof, TeamClosure)
    assert found.proof.never == (0,)
    assert found.proof.live == (False,)
    regions = floor.problem.members[0].graph.regions_of(found.proof.reach[0])
    assert regions == sum(1 << region for region in range(13, 17))


def test_an_obstacle_that_need_not_be_passed_is_a_wall() -> None:
    floor = Floor(["#####", "#...#", "#...#", "#####"], {"r": Bot("6", [8])}, [door(7)])
    found = settled(floor)
    assert found.proof is None
    assert found.served == ()


def test_cyclic_needs_are_never_resolved() -> None:
    """Each obstacle keeps the only robot away that could resolve the other one."""
    floor = Floor(
        HALL,
        {"a": Bot("13", [13], "push"), "b": Bot("22", [22], "sense"), "r": Bot("17", [13, 22])},
        [Block(15, [("sense", 1, [16], False)]), Block(19, [("push", 1, [18], False)])],
    )
    solver = Solver(floor.problem)
    stages = floor.problem.nothing_done
    closure = closure_of(solver, solver.sets(floor.poses, stages), stages)
    assert closure.never == (0, 1)


SHAFT = ["#######", "#.....#", "#.....#", "###.###", "###.###", "#######"]
"""A turning robot that goes down the shaft (24, 31) never comes back."""


def test_one_way_choices_are_refuted_one_by_one() -> None:
    """Two obstacles, each resolved only at the end of a blind alley that swallows the only robot
    which could resolve them."""
    grid = ["#########", "#.......#", "#..##.#.#", "##.##.###", "##.##.###", "#########"]
    floor = Floor(
        grid,
        {"t": Bot("12e", [10], "push"), "r": Bot("10", [16])},
        [
            Block(13, [("push", 1, [38], False)], blocks=[1]),
            Block(15, [("push", 1, [41], False)], blocks=[1]),
        ],
    )
    solver = Solver(floor.problem)
    stages = floor.problem.nothing_done
    sets = solver.sets(floor.poses, stages)
    assert not solver.feasible(sets, stages)
    assert isinstance(refute(solver, sets, stages), TeamClosure | tuple)


def test_poses_that_lose_a_helper_are_not_kept() -> None:
    """The only robot that can push must not go down the shaft before the door is open."""
    floor = Floor(
        SHAFT,
        {"t": Bot("8e", [31], "push", holds=True), "r": Bot("9", [12])},
        [
            Block(11, [("push", 1, [11], False)], blocks=[1]),
            Block(18, [("push", 1, [18], False)], blocks=[1]),
        ],
    )
    found = settled(floor)
    assert found.proof is None
    graph = floor.problem.members[0].graph
    assert not graph.regions_of(found.safe_poses[0]) & (1 << 24 | 1 << 31)
    assert {robot: duty.gate for robot, duty in found.duties.items()} == {0: 0}
