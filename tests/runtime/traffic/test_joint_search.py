"""Joint plans: found where there is one, refuted where there is none, valid in every order."""

import random
from collections.abc import Callable

import pytest
from msgspec.structs import replace
from safenav.runtime.resolution.problem import Separation, Stages
from safenav.runtime.traffic.joint_search.execution import (
    Execution,
    Order,
    Schedule,
    in_turn,
    required_counts,
    schedule,
)
from safenav.runtime.traffic.joint_search.search import Search, Variant
from safenav.runtime.traffic.joint_search.states import (
    BudgetExhausted,
    Count,
    Course,
    Effort,
    Exhausted,
    Found,
    JointState,
    has_met,
)

from runtime.coordination.floors import Block, Bot, Floor

SWAP = ["#####", "#...#", "##.##", "#####"]
TUBE = ["######", "#....#", "######"]
RING = ["#####", "#...#", "#.#.#", "#...#", "#####"]


def search(
    floor: Floor, rounds: int = 1, goal: Callable[[JointState], bool] | None = None
) -> Search:
    course = Course(floor.problem, rounds)
    start = course.begun(floor.poses, floor.counts, floor.problem.nothing_done)

    def guide(stages: Stages, poses: tuple[int, ...]) -> list[None]:
        assert len(stages) == len(floor.problem.gates)
        return [None] * len(poses)

    return Search(course, guide, start, goal or course.completed)


def play(floor: Floor, found: Found, rng: random.Random) -> None:
    """Execute a plan with random delays: no collision, no deadlock, the end as planned."""
    members, conflicts = floor.problem.members, floor.problem.conflicts
    sizes = [member.graph.size for member in members]
    joint = [state.poses for state in found.states]
    zones = floor.problem.zones
    plan = schedule(Separation(sizes, conflicts, zones), joint)
    run = Execution(plan)
    poses = list(joint[0])
    leaving: dict[int, int] = {}
    for _ in range(10_000):
        if run.finished and not leaving:
            break
        robot = rng.randrange(len(poses))
        if robot in leaving:
            poses[robot] = leaving.pop(robot)
            run.arrived(robot)
            continue
        pose = run.next(robot)
        if pose is None:
            continue
        assert pose in members[robot].graph.steps(poses[robot])
        for other in conflicts[robot]:
            held = {poses[other] % sizes[other]}
            held |= {leaving[other] % sizes[other]} if other in leaving else set()
            assert pose % sizes[robot] not in held
        for robots, zone in zones:
            if robot in robots and zone >> pose % sizes[robot] & 1:
                others = robots - {robot}
                at = [poses[i] % sizes[i] for i in others]
                at += [leaving[i] % sizes[i] for i in others & leaving.keys()]
                assert not any(zone >> place & 1 for place in at)
        leaving[robot] = pose
    assert tuple(poses) == joint[-1]


def test_two_robots_change_places_by_a_niche() -> None:
    floor = Floor(SWAP, {"a": Bot("6", [8, 6]), "b": Bot("8", [6, 8])})
    found = search(floor).run()
    assert isinstance(found, Found)
    for seed in range(20):
        play(floor, found, random.Random(seed))


@pytest.mark.parametrize(("restarts", "end"), [(True, Exhausted), (False, Found)])
def test_rounds_restart_with_resolutions_but_of_batteries(restarts: bool, end: type) -> None:
    """a has met its target behind v, and could not get there again."""
    bots = {"a": Bot("7", [10]), "v": Bot("8", [8], "lift")}
    floor = Floor(TUBE, bots, [Block(8, [("lift", 1, [9], False)], blocks=[])])
    gates = (replace(floor.problem.gates[0], restarts=restarts),)
    floor.problem, floor.counts = replace(floor.problem, gates=gates), ((0, 0, 1), (0, 0, 0))
    completed, resolved = Course(floor.problem, 1).completed, floor.problem.resolved
    found = search(floor, goal=lambda one: resolved(0, one.stages) and completed(one)).run()
    assert isinstance(found, end)


def test_a_plan_leads_around_a_robot_that_cannot_move() -> None:
    """As one out of service: it stands on the shortest path."""
    grid = ["###########", *["#....#....#"] * 2, "#.........#", *["#....#....#"] * 5]
    bots = {"out": Bot("38", []), "a": Bot("37", [40])}
    bots |= {f"o{at}": Bot(str(at), [at]) for at in (12, 14, 23, 35, 46, 47, 57, 59)}
    floor = Floor([*grid, "#.........#", "###########"], bots)
    out, *others = floor.problem.members
    out = replace(out, floor=1 << floor.poses[0], targets=())
    floor.problem = replace(floor.problem, members=(out, *others))
    assert isinstance(search(floor).by(Variant.STATIC, 60), Found)


def test_a_step_in_transit_waits_for_no_other_robot() -> None:
    """Of two robots, at most one is in the regions 1 to 3; one has set out for them already."""
    both = frozenset({0, 1})
    zones = ((both, 0b1110),)
    ways = [(0, 2), (1, 4), (0, 4), (1, 4)]
    waits = [
        (o.step, o.before)
        for o in schedule(Separation([5, 5], [frozenset()] * 2, zones), ways).orders
    ]
    assert waits == [(0, 0), (2, 0)]
    begun = schedule(Separation([5, 5], [frozenset()] * 2, zones), ways, [0])
    assert [(o.step, o.before) for o in begun.orders] == [(2, 0)]


@pytest.mark.parametrize(
    ("orders", "joint"),
    [
        ([], [(0, 5), (1, 5), (2, 5), (2, 6)]),
        ([Order(0, 1, 1, 0)], [(0, 5), (1, 5), (1, 6), (2, 6)]),
        ([Order(0, 1, 1, 0), Order(1, 0, 0, 1)], None),
    ],
    ids=["any", "one waits", "both wait"],
)
def test_the_steps_of_a_plan_one_after_the_other(
    orders: list[Order], joint: list[tuple[int, ...]] | None
) -> None:
    assert in_turn(Schedule(((0, 1, 2), (5, 6)), tuple(orders))) == joint


def test_a_corridor_without_a_niche_has_no_joint_plan() -> None:
    floor = Floor(TUBE, {"a": Bot("7", [10, 7]), "b": Bot("10", [7, 10])})
    answer = search(floor).run()
    assert isinstance(answer, Exhausted)
    assert len({state.poses for state in answer.states}) == 6


def test_no_robot_turns_in_a_full_cycle() -> None:
    """Four robots on a ring of four regions: each would have to enter a region that is full."""
    floor = Floor(
        ["####", "#..#", "#..#", "####"],
        {"a": Bot("5", [6]), "b": Bot("6", [10]), "c": Bot("10", [9]), "d": Bot("9", [5])},
    )
    assert isinstance(search(floor).run(), Exhausted)


def test_a_robot_without_a_target_makes_way_and_may_be_pushed() -> None:
    floor = Floor(SWAP, {"a": Bot("6", [8, 6]), "h": Bot("7", [7], holds=True)})
    found = search(floor).run()
    assert isinstance(found, Found)
    assert found.states[-1].poses[1] is not None


def test_headings_make_plans_for_the_next_goal_insufficient() -> None:
    """Down a blind alley a robot with heading mobility never turns: its last target may be there
    if nothing is left to do, and not before."""
    grid = ["#####", "#...#", "#...#", "#.###", "#.###", "#####"]
    for bot, end in (
        (Bot("6e", [21, 8]), Exhausted),
        (Bot("6e", [8, 21], any_order=True), Exhausted),
        (Bot("6e", [21], holds=True), Found),
    ):
        assert isinstance(search(Floor(grid, {"a": bot})).run(), end), bot


def test_an_exhausted_budget_proves_nothing() -> None:
    floor = Floor(RING, {"a": Bot("6", [18, 6]), "b": Bot("18", [6, 18]), "c": Bot("8", [16])})
    assert isinstance(search(floor, rounds=3).singles(5), BudgetExhausted)


def never(_: JointState) -> bool:
    return False


@pytest.mark.parametrize("left", [0, 50, 300])
def test_all_parts_of_a_search_share_one_budget(left: int) -> None:
    """Of all variants, legs and proofs together: one joint state's successors more at most."""
    starts = ("6", "8", "16", "18")
    floor = Floor(RING, {f"r{k}": Bot(at, [12 + k]) for k, at in enumerate(starts)})
    asked = search(floor, goal=never)
    asked.work = Effort(left)
    assert isinstance(asked.run(), BudgetExhausted)
    assert -5 * len(floor.poses) ** 2 <= asked.work.left <= 0


BOTTLENECK = ["#########", "#...#...#", "#.......#", "#########"]
POCKETS = ["#########", "#.......#", "#...#...#", "#########"]


@pytest.mark.parametrize(
    ("grid", "bots"),
    [
        pytest.param(
            BOTTLENECK,
            [
                Bot("14s", [20, 24]),
                Bot("16", [25, 19]),
                Bot("20", [19, 16]),
                Bot("24", [25, 10]),
                Bot("11w", [11, 25]),
                Bot("21e", [15, 11]),
                Bot("19w", [23, 20]),
                Bot("15e", [23, 19]),
            ],
            id="crowd 500003",
        ),
        pytest.param(
            BOTTLENECK,
            [
                Bot("15", [12], holds=True),
                Bot("14", [10, 12, 25]),
                Bot("22", [16], holds=True),
                Bot("11", [11], any_order=True),
                Bot("19n", [19, 11, 12], any_order=True),
                Bot("10w", [25], any_order=True),
                Bot("25", [15, 16]),
                Bot("20n", [22, 10, 15]),
            ],
            id="crowd_hidden 1000096",
        ),
        pytest.param(
            POCKETS,
            [
                Bot("11e", [16, 24]),
                Bot("15", [25, 11]),
                Bot("21n", [25, 13]),
                Bot("10", [15, 21]),
                Bot("20e", [10, 20]),
                Bot("19", [20, 23]),
                Bot("16n", [16, 14]),
                Bot("13", [13, 12]),
            ],
            id="crowd 1000460",
        ),
    ],
)
def test_crowded_floors_have_joint_plans_of_several_legs(grid: list[str], bots: list[Bot]) -> None:
    """Eight robots in thirteen regions, some of which cannot turn round: searches for all of them
    at once found no plan in a minute."""
    floor = Floor(grid, {f"r{i}": bot for i, bot in enumerate(bots)})
    found = search(floor).run(4)
    assert isinstance(found, Found)
    play(floor, found, random.Random(0))


@pytest.mark.parametrize("variant", Variant)
def test_every_search_variant_exhausts_no_more_states_than_single_steps(variant: Variant) -> None:
    floor = Floor(TUBE, {"a": Bot("7", [10, 7]), "b": Bot("10", [7, 10])})
    one, other = search(floor).by(variant, 1000), search(floor).singles(1000)
    assert isinstance(one, Exhausted)
    assert isinstance(other, Exhausted)
    assert one.states <= other.states


@pytest.mark.parametrize("seed", range(40))
def test_variants_agree_with_the_exhaustive_search(seed: int, played: Callable[[], None]) -> None:
    """Two or three robots with and without headings on tight floors."""
    rng = random.Random(seed)
    count = 0
    while count < 2:
        rows, cols = rng.choice([(1, 4), (2, 3), (2, 4), (3, 3)])
        inside = [["." if rng.random() < 0.85 else "#" for _ in range(cols)] for _ in range(rows)]
        grid = ["#" * (cols + 2), *(f"#{''.join(row)}#" for row in inside), "#" * (cols + 2)]
        free = [i for i, c in enumerate("".join(grid)) if c == "."]
        count = min(rng.randint(2, 3), len(free) - 1)
    starts = rng.sample(free, count)
    bots = {
        f"r{k}": Bot(f"{start}{rng.choice(['', *'nesw'])}", rng.sample(free, rng.randint(1, 2)))
        for k, start in enumerate(starts)
    }
    floor = Floor(grid, bots)
    truth = search(floor).singles(200_000)
    assert not isinstance(truth, BudgetExhausted)
    answer = search(floor).run()
    assert type(answer) is type(truth)
    played()
    if isinstance(answer, Found):
        play(floor, answer, rng)


def test_a_plan_waits_until_the_goals_that_it_assumes_are_met() -> None:
    """Two rounds of a single target are met by staying there for two ticks: before the robot is
    told so, it must not leave."""
    floor = Floor(SWAP, {"a": Bot("6", [8]), "b": Bot("8", [6])})
    found = search(floor, rounds=2).run()
    assert isinstance(found, Found)
    poses = [state.poses for state in found.states]
    ways = schedule(Separation([floor.world.size] * 2, floor.problem.conflicts), poses).paths
    dues = required_counts(found.states, found.states[0].counts)
    assert [[ways[i][place] for place in due] for i, due in enumerate(dues)] == [[8], [6]]
    assert [list(due.values()) for due in dues] == [[(0, 0, 2)], [(0, 0, 2)]]
    run = Execution(
        schedule(Separation([floor.world.size] * 2, floor.problem.conflicts), poses), dues
    )
    assert run.due(0) is None
    run.taken[0] = ways[0].index(8)
    assert run.due(0) == (0, 0, 2)


def test_a_plan_waits_for_a_goal_that_its_first_state_assumes() -> None:
    """A robot that stands on a target has not counted it yet, and the plan takes it for met."""
    floor = Floor(SWAP, {"a": Bot("6", [6, 8]), "b": Bot("8", [6])})
    found = search(floor).run()
    assert isinstance(found, Found)
    assert found.states[0].counts[0] != (0, 0, 0)
    dues = required_counts(found.states, ((0, 0, 0), (0, 0, 0)))
    assert dues[0][0] == found.states[0].counts[0]
    assert 0 not in dues[1]


@pytest.mark.parametrize(
    ("count", "due", "met"),
    [
        ((0, 0, 1), (0, 0, 2), False),
        ((1, 0, 3), (0, 0, 2), True),
        ((0, 0b01, 1), (0, 0b11, 1), False),
        ((0, 0b11, 1), (0, 0b01, 1), True),
        ((0, 0, 2), (0, 0b01, 1), True),
    ],
)
def test_later_rounds_goals_and_turns_meet_earlier_ones(
    count: Count, due: Count, met: bool
) -> None:
    assert has_met(count, due) is met
