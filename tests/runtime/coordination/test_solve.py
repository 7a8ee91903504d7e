"""Duties on small floors: capable robots, and options that must be preserved meanwhile."""

from safenav.runtime.duties.settlement import Settlement, settle
from safenav.runtime.resolution.solve import Solver

from runtime.coordination.floors import Block, Bot, Floor


def settled(floor: Floor) -> Settlement:
    order = tuple(range(len(floor.problem.gates)))
    stages = floor.problem.nothing_done
    return settle(Solver(floor.problem), floor.poses, stages, order, {})


def gates_of(found: Settlement) -> dict[int, int]:
    assert found.proof is None
    return {robot: duty.gate for robot, duty in found.duties.items()}


def test_two_robots_that_lift_together_stand_in_different_regions() -> None:
    floor = Floor(
        ["############", "#..........#", "############"],
        {"a": Bot("13", [13], "lift"), "b": Bot("14", [14], "lift"), "c": Bot("22", [22, 13])},
        [Block(17, [("lift", 2, [16, 15], True)])],
    )
    assert gates_of(settled(floor)) == {0: 0, 1: 0}


def test_poses_from_which_a_helper_cannot_return_are_not_safe() -> None:
    """The only robot that can push must not go down the shaft (24, 31) before the door is open:
    it turns, and would never come back."""
    floor = Floor(
        ["#######", "#.....#", "#.....#", "###.###", "###.###", "#######"],
        {"t": Bot("8e", [31], "push", holds=True), "r": Bot("9", [12])},
        [
            Block(11, [("push", 1, [11], False)], blocks=[1]),
            Block(18, [("push", 1, [18], False)], blocks=[1]),
        ],
    )
    found = settled(floor)
    assert gates_of(found) == {0: 0}
    graph = floor.problem.members[0].graph
    assert not graph.regions_of(found.safe_poses[0]) & (1 << 24 | 1 << 31)
