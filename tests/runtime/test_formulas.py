"""Effects of raw formulas on a robot: allowed steps, goals, memory; ``cases/formulas``."""

import pytest
from msgspec.structs import replace

from runtime.played import loaded
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl
from safenav.team.formulas import graph_of, targets_of
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, bits

WORLD = RegionMap.from_grid(["######", "#....#", "######"])  # regions 7 8 9 10
BOOL = {"seen": None}


ROBOT = """
map: {grid: ["######", "#....#", "######"]}
robots: {r: {model: MODEL, start: 7, objective: {visit: [7]}}}
"""


def graph(objective: Ltl, mobility: Mobility = Mobility.FREE) -> PoseGraph:
    """The steps of a robot that shares its floor with nobody."""
    model = "digit" if mobility is Mobility.HEADING else "quadcopter"
    heading = ", heading: east" if mobility is Mobility.HEADING else ""
    text = ROBOT.replace("MODEL", model).replace("start: 7", f"start: 7{heading}")
    robot = loaded(text).robots[0]
    return graph_of(replace(robot, objective=objective), WORLD, shared=False)


@pytest.mark.parametrize(
    ("safety", "memory", "closed"),
    [
        pytest.param((), {}, set(), id="nothing"),
        pytest.param(("region' != 9",), {}, {(8, 9), (10, 9)}, id="a zone"),
        pytest.param(("region = 8 -> region' != 9",), {}, {(8, 9)}, id="one way"),
        pytest.param(("region = 8 -> X(region = 8 | region = 7)",), {}, {(8, 9)}, id="next"),
        pytest.param(("seen -> region' != 9",), BOOL, set(), id="with some memory"),
        pytest.param(
            ("seen -> region' != 9", "region = 8 -> seen"), BOOL, {(8, 9)}, id="with no memory"
        ),
    ],
)
def test_safety_formulas_close_exactly_the_steps_that_they_forbid(
    safety: tuple[str, ...], memory: dict[str, None], closed: set[tuple[int, int]]
) -> None:
    found = graph(Ltl(safety=safety, memory=memory))
    plain = PoseGraph(WORLD, Mobility.FREE)
    shut = {(p, q) for p in WORLD.free for q in plain.steps(p) if q not in found.steps(p)}
    assert shut == closed
    assert found.one_way is bool(closed)


@pytest.mark.parametrize("mobility", Mobility)
def test_forward_and_backward_masks_agree_with_single_steps(mobility: Mobility) -> None:
    here = "heading = 1 & region = 8" if mobility is Mobility.HEADING else "region = 8"
    safety = (f"{here} -> region' != 9", "region' != 7")
    found = graph(Ltl(safety=safety), mobility)
    poses = list(bits(found.everywhere))
    steps = {(p, q) for p in poses for q in found.steps(p)}
    assert {(p, q) for p in poses for q in bits(found.forward(1 << p))} == steps
    assert {(p, q) for q in poses for p in bits(found.backward(1 << q))} == steps
    assert found.forward(found.everywhere) == sum(1 << q for q in {q for _, q in steps})
    assert found.backward(found.everywhere) == sum(1 << p for p in {p for p, _ in steps})


@pytest.mark.parametrize(
    ("goal", "regions"),
    [
        pytest.param("region = 8", {8}, id="now"),
        pytest.param("region' = 8", {8}, id="next"),
        pytest.param("region = 8 | region' = 10", {8, 10}, id="either"),
        pytest.param("region = 8 & region' = 9", {9}, id="a step"),
        pytest.param("seen & region = 8", {8}, id="with memory"),
    ],
)
def test_regions_in_which_a_goal_is_met(goal: str, regions: set[int]) -> None:
    formulas = Ltl(liveness=(goal,), memory=BOOL if "seen" in goal else {})
    assert [set(bits(mask)) for mask in targets_of(formulas, graph(formulas))] == [regions]


@pytest.mark.parametrize(
    ("memory", "step", "after"),
    [
        ({"seen": 0}, (8, 9), {"seen": 1}),
        ({"seen": 1}, (9, 10), {"seen": 1}),
        ({"seen": 0}, (9, 10), {"seen": 0}),
        ({"seen": 1}, (9, 8), None),
        ({}, (9, 8), {"seen": 0}),
    ],
)
def test_memory_after_a_step(
    memory: dict[str, int], step: tuple[int, int], after: dict[str, int] | None
) -> None:
    formulas = Ltl(safety=("seen' <-> seen | region = 8", "seen -> !(region' = 8)"), memory=BOOL)
    assert guarantees_of(formulas).remembered(memory, Pose(step[0]), Pose(step[1])) == after


def test_formulas_constrain_headings() -> None:
    found = guarantees_of(Ltl(safety=("heading = 1 -> heading' = 1",)))
    assert found.remembered({}, Pose(8, Heading.EAST), Pose(9, Heading.EAST)) == {}
    assert found.remembered({}, Pose(8, Heading.EAST), Pose(8, Heading.NORTH)) is None
