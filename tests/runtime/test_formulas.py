"""Effects of raw formulas on a robot: allowed steps, goals, memory; ``cases/formulas``."""

import pytest
from msgspec.structs import replace
from safenav.runtime.formulas import Formulas

from safenav.scenario.objective import Ltl
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, bits

WORLD = RegionMap.from_grid(["######", "#....#", "######"])  # regions 7 8 9 10
BOOL = {"seen": None}


def read(mobility: Mobility = Mobility.FREE, **body: object) -> Formulas:
    return Formulas(replace(Ltl(), **body), WORLD, mobility)  # type: ignore[arg-type]


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
    graph = read(safety=safety, memory=memory).graph
    plain = PoseGraph(WORLD, Mobility.FREE)
    found = {(p, q) for p in WORLD.free for q in plain.steps(p) if q not in graph.steps(p)}
    assert found == closed
    assert graph.one_way is bool(closed)


@pytest.mark.parametrize("mobility", Mobility)
def test_forward_and_backward_masks_agree_with_single_steps(mobility: Mobility) -> None:
    here = "heading = 1 & region = 8" if mobility is Mobility.HEADING else "region = 8"
    safety = (f"{here} -> region' != 9", "region' != 7")
    graph = read(mobility, safety=safety).graph
    poses = list(bits(graph.everywhere))
    steps = {(p, q) for p in poses for q in graph.steps(p)}
    assert {(p, q) for p in poses for q in bits(graph.forward(1 << p))} == steps
    assert {(p, q) for q in poses for p in bits(graph.backward(1 << q))} == steps
    assert graph.forward(graph.everywhere) == sum(1 << q for q in {q for _, q in steps})
    assert graph.backward(graph.everywhere) == sum(1 << p for p in {p for p, _ in steps})


@pytest.mark.parametrize(
    ("goal", "regions", "stays"),
    [
        pytest.param("region = 8", {8}, True, id="now"),
        pytest.param("region' = 8", {8}, True, id="next"),
        pytest.param("region = 8 | region' = 10", {8, 10}, True, id="either"),
        pytest.param("region = 8 & region' = 9", {9}, False, id="a step"),
        pytest.param("seen & region = 8", {8}, False, id="with memory"),
    ],
)
def test_regions_in_which_a_goal_is_met(goal: str, regions: set[int], stays: bool) -> None:
    formulas = read(liveness=(goal,), memory=BOOL if "seen" in goal else {})
    assert [set(bits(mask)) for mask in formulas.goals] == [regions]
    assert formulas.met_by_staying is stays


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
    formulas = read(safety=("seen' <-> seen | region = 8", "seen -> !(region' = 8)"), memory=BOOL)
    assert formulas.guarantees.remembered(memory, Pose(step[0]), Pose(step[1])) == after


def test_formulas_constrain_headings() -> None:
    formulas = read(Mobility.HEADING, safety=("heading = 1 -> heading' = 1",))
    assert formulas.guarantees.remembered({}, Pose(8, Heading.EAST), Pose(9, Heading.EAST)) == {}
    assert formulas.guarantees.remembered({}, Pose(8, Heading.EAST), Pose(8, Heading.NORTH)) is None
