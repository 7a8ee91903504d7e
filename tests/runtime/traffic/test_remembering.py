"""Paths over poses and the memory of formulas."""

import pytest
from safenav.runtime.traffic.budgets import REMEMBERED_STATES
from safenav.runtime.traffic.joint_search.formula_memory import StateGraph, state_graph

from safenav.scenario.objective import Ltl
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility, Pose

WORLD = RegionMap.from_grid(["#####", "#...#", "#####"])  # regions 6, 7 and 8
LATCH = Ltl(
    safety=("done' <-> (done | region = 6)", "done -> region' != 8"),
    liveness=("done & region = 7",),
    memory={"done": None},
)


def state(graph: StateGraph, region: int, *done: int) -> int:
    found = graph.state(graph.number(Pose(region)), dict(zip(["done"], done, strict=False)))
    assert found is not None
    return found


def test_states_with_a_latched_flag_never_return_to_those_without() -> None:
    graph = StateGraph(LATCH, WORLD, Mobility.FREE)
    start, later = state(graph, 7, 0), state(graph, 7, 1)
    assert graph.one_way
    assert not graph.returns(later, start, graph.everywhere)
    assert graph.closure(1 << start, graph.everywhere) >> later & 1
    assert not graph.back(1 << start, graph.everywhere) >> later & 1


@pytest.mark.parametrize(
    ("bounds", "known"), [(None, True), ((0, 63), True), ((0, 64), False)], ids=str
)
def test_memory_is_part_of_states_only_up_to_a_size_limit(
    bounds: tuple[int, int] | None, known: bool
) -> None:
    objective = Ltl(liveness=("region = 7",), memory={"m": bounds})
    assert (state_graph(objective, WORLD, Mobility.FREE) is not None) == known
    wide = RegionMap.from_grid(["." * 100] * (REMEMBERED_STATES // 100))
    assert state_graph(objective, wide, Mobility.FREE) is None


def test_formulas_without_memory_need_poses_only() -> None:
    assert state_graph(Ltl(liveness=("region = 7",)), WORLD, Mobility.FREE) is None


def test_a_goal_about_a_step_is_met_by_that_step_alone() -> None:
    leaving = Ltl(liveness=("region = 7 & region' != 7", "region = 6"))
    graph = state_graph(leaving, WORLD, Mobility.FREE)
    assert graph is not None and not graph.one_way
    left, other = graph.goals
    six, seven, eight = (state(graph, region) for region in (6, 7, 8))
    assert not left >> six & 1 and other >> six & 1  # its path there is unknown
    after = graph.after(seven, 6) + graph.after(seven, 8)
    assert [left >> s & 1 for s in after] == [1, 1]
    assert [left >> s & 1 for s in graph.after(after[0], 7)] == [0]
    assert [left >> s & 1 for s in graph.after(eight, 7)] == [0]
