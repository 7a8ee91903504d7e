"""The regions to which a robot can be sent from a pose without losing its own objective, and those
that known obstacles close to it."""

import pytest

from oracle.text import truth
from safenav import Heading, Pose, RegionMap, Robot, Task, compile_task
from safenav.scenario.model import RobotModel
from safenav.scenario.objective import Cover, Hold, Ltl, Objective, Visit
from safenav.spec.assignable import AssignableRegions, assignable_regions
from safenav.spec.task import Known
from safenav.world.poses import Mobility

CORRIDOR = RegionMap.from_grid(["#######", "#.....#", "#######"])  # regions 8 to 12
RING = RegionMap.from_grid(["#####", "#...#", "#.#.#", "#...#", "#####"])  # 6 to 18 around 12
WEST = Heading.WEST


def sent(
    start: Pose, objective: Objective, world: RegionMap = CORRIDOR, *blocked: int
) -> AssignableRegions:
    mobility = Mobility.FREE if start.heading is None else Mobility.HEADING
    robot = Robot("r", RobotModel("m", mobility, "ground", frozenset()), start, objective)
    known = tuple(Known(region, "door", "it stays") for region in blocked)
    return assignable_regions(Task(robot, start, objective, blocked=known, assignable=True), world)


def sent_to(found: AssignableRegions, pose: Pose, *memory: tuple[str, int]) -> set[int]:
    """The regions assignable in a state."""
    return {place for place in range(13) if found.allows((pose, memory), place)}


def visit(*regions: int) -> Visit:
    return Visit(tuple(frozenset({region}) for region in regions))


@pytest.mark.parametrize(
    ("objective", "regions"),
    [
        pytest.param(visit(10), {8, 9, 10, 11, 12}, id="everywhere"),
        pytest.param(Hold((frozenset({8}),)), {8, 9, 10, 11, 12}, id="holds"),
        pytest.param(
            Ltl(safety=("region' != 11",), liveness=("region = 8",)), {8, 9, 10}, id="a zone"
        ),
        pytest.param(
            Ltl(safety=("region = 10 -> region' != 9",), liveness=("region = 8",)),
            {8, 9},
            id="no way back to its goal",
        ),
        pytest.param(
            Ltl(safety=("region = 11 -> region' != 11",), liveness=("region = 8",)),
            {8, 9, 10},
            id="not where it cannot wait",
        ),
    ],
)
def test_assignable_regions_keep_the_objective_possible(
    objective: Objective, regions: set[int]
) -> None:
    assert sent(Pose(9), objective) == AssignableRegions(frozenset(regions))


def test_irreversible_steps_obstacles_and_directions_limit_assignable_regions() -> None:
    assert sent(Pose(9), visit(9), CORRIDOR, 11).places == {8, 9, 10}  # obstacles stay
    both = Cover((frozenset({18}), frozenset({8})))  # both directions around are equivalent
    around = sent(Pose(6, Heading.EAST), both, RING)
    assert around == AssignableRegions(frozenset(RING.free))
    # If the objective is lost already, nothing is assigned.
    assert sent(Pose(11, WEST), visit(12)) == AssignableRegions()


def test_no_region_before_an_irreversible_step_is_assignable_after_it() -> None:
    ltl = Ltl(safety=("region = 10 -> region' != 9",), liveness=("region = 12",))
    found = sent(Pose(9), ltl)
    assert [sent_to(found, Pose(here)) for here in (9, 10)] == [{8, 9, 10, 11, 12}, {10, 11, 12}]


def test_with_headings_a_corridor_is_irreversible() -> None:
    """Its goal is either end: regions up to the end that it faces are assignable."""
    found = sent(Pose(11, WEST), Visit((frozenset({8, 11}),)))
    ways = [sent_to(found, Pose(region, WEST)) for region in (8, 9, 10, 11)]
    assert ways == [{8}, {8, 9}, {8, 9, 10}, {8, 9, 10, 11}]


def test_the_memory_of_a_robot_limits_its_assignable_regions() -> None:
    """Once it has been at 12 it must no longer go to 8."""
    ltl = Ltl(
        init=("!done",),
        safety=("done' <-> (done | region = 12)", "done -> region' != 8"),
        liveness=("region = 10",),
        memory={"done": None},
    )
    found = sent(Pose(9), ltl)
    ways = [sent_to(found, Pose(9), ("done", k)) for k in (0, 1)]
    assert ways == [{8, 9, 10, 11, 12}, {9, 10, 11, 12}]
    assert 8 not in sent_to(found, Pose(12), ("done", 0))  # at 12, so `done` holds next


def test_no_robot_enters_an_obstacle_but_it_may_stay_where_one_is() -> None:
    robot = Robot("r", RobotModel("m", Mobility.FREE, "ground", frozenset()), Pose(9), visit(8, 9))
    known = tuple(Known(region, "door", "it is closed") for region in (9, 10))
    spec = compile_task(Task(robot, Pose(9), robot.objective, blocked=known), CORRIDOR)
    rules = [truth(c.formula) for c in spec.constraints if c.section == "SYS_TRANS"]
    steps = [(a, b) for a in CORRIDOR.free for b in CORRIDOR.free]
    allowed = {s for s in steps if all(r(*({"region": at} for at in s)) for r in rules)}
    assert allowed == {(8, 8), (9, 8), (9, 9), (10, 11), (11, 11), (11, 12), (12, 11), (12, 12)}
