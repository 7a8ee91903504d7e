"""Progress with an objective: what counts where, and that joint plans count the same."""

from random import Random

import pytest
from safenav.runtime.progress import Progress
from safenav.runtime.resolution.problem import Member, Problem
from safenav.runtime.traffic.joint_search.states import Course

from safenav.scenario.objective import (
    Cover,
    Hold,
    Ltl,
    Objective,
    Patrol,
    TargetObjective,
    Visit,
)
from safenav.spec.objective import Memory
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph

A, B, C, D = (frozenset({region}) for region in (7, 8, 9, 10))
WORLD = RegionMap.from_grid(["######", "#....#", "######"])


@pytest.mark.parametrize(
    ("objective", "way", "goals", "rounds"),
    [
        pytest.param(Visit((A, B)), [7, 8, 7, 7, 8], [[0], [1], [0], [], [1]], 2, id="in turn"),
        pytest.param(Visit((A,)), [7, 7, 8], [[0], [0], []], 2, id="each tick on the only one"),
        pytest.param(Patrol((A, B)), [8, 7, 7, 8], [[1], [0], [], [1]], 1, id="begins where it is"),
        pytest.param(Cover((A, B)), [8, 8, 9, 7], [[1], [], [], [0]], 1, id="any order"),
        pytest.param(Cover((A, A | B)), [7, 8], [[0, 1], [1]], 1, id="two at once"),
        pytest.param(Hold((A,)), [7, 7, 8, 7], [[0], [], [], [0]], 3, id="holds"),
    ],
)
def test_each_kind_of_objective_counts_its_targets_and_rounds(
    objective: Objective, way: list[int], goals: list[list[int]], rounds: int
) -> None:
    progress = Progress(objective)
    told = [progress.begin(way[0], {})]
    told += [progress.arrive(region, {}, {}) for region in way[1:]]
    assert told == goals
    assert progress.rounds == rounds


def test_the_last_of_two_goals_met_together_completes_the_round() -> None:
    progress = Progress(Cover((A, A | B)))
    assert progress.counted(progress.begin(8, {})) == [(1, 0)]
    assert progress.counted(progress.arrive(7, {}, {})) == [(0, 1)]
    assert progress.counted(progress.arrive(7, {}, {})) == [(0, 1), (1, 2)]


def test_goals_of_formulas_are_met_by_steps_and_memory() -> None:
    objective = Ltl(liveness=("seen & region = 8", "region' = 9"), memory={"seen": None})
    progress = Progress(objective)
    assert progress.begin(8, {"region": 8, "seen": 1}) == []
    assert progress.memory.values == {"seen": 1}
    assert progress.arrive(9, {"region": 8, "seen": 1}, {"region": 9, "seen": 0}) == [0, 1]
    assert progress.arrive(9, {}, {}) == []  # off its strategy
    assert (progress.rounds, progress.memory.values) == (1, {"seen": 0})


def test_a_resolution_restarts_the_rounds_and_keeps_the_next_target() -> None:
    visit, cover = Progress(Visit((A, B))), Progress(Cover((A, B)))
    for progress in (visit, cover):
        progress.begin(7, {})
        progress.restart_count()
    assert visit.awaited() == B
    assert cover.awaited() == A | B
    assert visit.memory == Memory(1)


def test_a_specification_means_the_same_before_its_memory_has_changed() -> None:
    progress = Progress(Visit((A, B)))
    progress.begin(7, {})  # the first is met, and the second is next
    assert [m for m in (0, 1) if progress.means(m, 7)] == [0, 1]
    assert [m for m in (0, 1) if progress.means(m, 9)] == [1]


@pytest.mark.parametrize(
    "objective", [Visit((A, B, C)), Patrol((A, B, C)), Patrol((B, D)), Cover((A, B, D))]
)
def test_joint_plans_count_goals_as_runs_do(objective: TargetObjective) -> None:
    """A walk that waits a tick after each step: plans count at once what is met by waiting."""
    graph = PoseGraph(WORLD, Mobility.FREE)
    pursuit = objective
    targets = tuple(graph.poses_on(1 << min(target)) for target in objective.targets)
    member = Member("r", graph, graph.everywhere, targets, pursuit.in_turn, False, frozenset())
    course = Course(Problem((member,), (), (frozenset(),)), rounds=1000)
    random, region = Random(7), 8
    progress = Progress(objective)
    progress.begin(region, {})
    start = objective.begin(region)
    state = course.begun((region,), ((start, 0, 0),), ())
    for _ in range(300):
        region = random.choice(graph.steps(region))
        for _ in range(2):
            progress.arrive(region, {}, {})
        state = course.after(state, 0, region)
        index, seen, met = state.counts[0]
        if pursuit.in_turn:
            assert index == progress.memory.index
            assert met == progress.rounds * len(targets) + len(progress.seen)
        else:
            assert {k for k in range(len(targets)) if seen >> k & 1} == progress.seen
            assert met == progress.rounds
