"""The automaton of an objective and its formulas say the same, step by step, and the steps of a
robot are those of its map; strategies of visits keep their order, and those that avoid others never
meet them."""

from itertools import product
from pathlib import Path
from random import Random

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from safenav import (
    Heading,
    Pose,
    RegionMap,
    Robot,
    Synthesizer,
    Task,
    Verdict,
    compile_task,
    first_failure,
)
from safenav.formula.parser import parse
from safenav.formula.syntax import evaluate, predicate
from safenav.scenario.model import RobotModel
from safenav.scenario.objective import Cover, Hold, Once, Patrol, TargetObjective, Visit
from safenav.spec.compile import assumption_names, busy, encode
from safenav.spec.specification import Section
from safenav.spec.task import NO_MEMORY, Known, Memory
from safenav.world.poses import Mobility, plain_graph
from support.examples import campaign

REGIONS = range(9)


def at(*regions: int) -> frozenset[int]:
    return frozenset(regions)


OBJECTIVES = [
    Patrol((at(0), at(8))),
    Patrol((at(0, 1), at(7, 8))),
    Patrol((at(0), at(4), at(8))),
    Patrol((at(0, 1), at(3), at(7, 8), at(5))),
    Visit((at(4),)),
    Visit((at(0), at(8), at(4))),
    Visit((at(0, 3), at(3, 6))),
    Cover((at(0), at(8), at(4))),
    Hold((at(4),)),
    Hold((at(4, 5),)),
    Once((at(0), at(8), at(4))),
    Once((at(0, 3), at(4, 5))),
    Once((at(4, 5),)),
]


def values(memory: int, region: int) -> dict[str, int]:
    return {"region": region, "scout": memory, "goal": memory, "request": 0}


@pytest.mark.parametrize("objective", OBJECTIVES, ids=str)
def test_a_step_is_allowed_and_counts_as_by_the_formulas(objective: TargetObjective) -> None:
    # A visit has a memory where goals are assigned at runtime; see below.
    encoding = encode(objective, "robots.r", 3, NO_MEMORY, assigned=True)
    rules, goals = (
        [predicate(parse(c.formula)) for c in encoding.constraints if c.section is section]
        for section in (Section.SYS_TRANS, Section.SYS_LIVENESS)
    )
    memories = range(len(objective.targets)) if objective.in_turn else (0,)
    steps = 0
    for memory, region, then, after in product(memories, REGIONS, memories, REGIONS):
        before, now = values(memory, region), values(then, after)
        if objective.strict and objective.begin(region, memory) != memory:
            continue  # a state that the formulas never let it be in
        kept = all(rule(before, now) for rule in rules)
        turned = objective.turned(memory, region) if objective.in_turn else memory
        assert kept == (then == turned and not objective.forbidden(memory, region, after))
        if kept:
            met = tuple(i for i, goal in enumerate(goals) if goal(before, now))
            counts = objective.met(then, after)
            if objective.in_turn and objective.settles:  # the last one alone is a goal forever
                counts = (0,) if len(objective.targets) - 1 in counts else ()
            assert met == counts
            steps += 1
    assert steps > 20


@pytest.mark.parametrize("objective", OBJECTIVES[:7], ids=str)
def test_an_objective_starts_as_the_formulas_require(objective: Patrol | Visit) -> None:
    for region, memory in product(REGIONS, range(len(objective.targets))):
        encoding = encode(objective, "robots.r", region, Memory(memory), assigned=True)
        start = values(objective.begin(region, memory), region)
        for constraint in encoding.constraints:
            if constraint.section is Section.SYS_INIT:
                assert evaluate(parse(constraint.formula), start, {})


@pytest.mark.parametrize("seed", range(12))
def test_a_strategy_takes_the_targets_of_a_visit_in_their_order(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its specification has no memory of the next target, from which it begins all the same."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path))
    random, world = Random(seed), RegionMap.from_grid(["....", ".##.", "...."])
    mobility = random.choice([*Mobility])
    heading = Heading(random.randrange(4)) if mobility is Mobility.HEADING else None
    pose = Pose(random.choice(world.free), heading)
    places, size = random.sample(world.free, 8), random.randint(1, 2)
    visit = Visit(tuple(at(*places[2 * k : 2 * k + size]) for k in range(random.randint(2, 4))))
    count, index = len(visit.targets), random.randrange(len(visit.targets))
    model = RobotModel("rover", mobility, "ground", frozenset())
    task = Task(Robot("a", model, pose, visit), pose, visit, Memory(index))
    spec = compile_task(task, world)
    assert {variable.name for variable in spec.variables} <= {"region", "heading"}
    strategy = Synthesizer(verifier=first_failure).synthesize(spec).strategy
    assert strategy is not None
    plain, memory = plain_graph(world, mobility), index
    node = strategy.initial()[0]
    here = 1 << plain.number(pose)
    for _ in range(3 * count):
        memory = visit.turned(memory, strategy.values(node)["region"])
        target = plain.on(visit.targets[memory])
        steps = 1 if here & target else plain.steps_between(here, target, plain.everywhere) or 0
        for _ in range(steps):  # the shortest way to the next target, or a stay at it
            (node,) = strategy.transitions[node]
            now = strategy.values(node)
            facing = Heading(now["heading"]) if heading is not None else None
            here = 1 << plain.number(Pose(now["region"], facing))
            if here & target:
                break
        assert here & target


WORLD = RegionMap.from_grid([".....", ".###.", "....."])


@pytest.mark.parametrize("names", [("b",), ("b", "c")], ids=len)
def test_a_robot_never_enters_an_occupied_region_and_meets_its_targets(
    names: tuple[str, ...],
) -> None:
    model = RobotModel("rover", Mobility.FREE, "ground", frozenset())
    objective = Visit((frozenset({0}), frozenset({14})))
    robot = Robot("rover", model, Pose(0), objective)
    task = Task(robot, robot.start, objective, avoids=names)
    result = Synthesizer(verifier=first_failure).synthesize(compile_task(task, WORLD))
    assert result.verdict is Verdict.REALIZABLE and result.verified
    assert assumption_names(task, WORLD) == [
        f"infinitely often no robot is beside it ({', '.join(names)})"
    ]
    strategy, draw = result.strategy, Random(7)
    assert strategy is not None
    node, others, visited = strategy.initial()[0], dict.fromkeys(names, 10), set[int]()
    for _ in range(400):
        here = strategy.values(node)["region"]
        for name, place in others.items():
            choices = [place, *(r for r in WORLD.neighbours(place) if r != here)]
            others[name] = draw.choice(choices)
        taken = {*others.values()}
        sides = {busy(side): int(WORLD.step(here, side) in taken) for side in Heading}
        node = strategy.successors_for(node, sides)[0]
        there = strategy.values(node)["region"]
        assert there == here or there not in taken
        visited.add(there)
    assert {0, 14} <= visited


@campaign(30)
@given(st.data())
def test_the_steps_of_a_robot_are_those_of_its_map(data: st.DataObject) -> None:
    """To free neighbours that are neither blocked nor lost; never backwards with a heading; and it
    may stay where it is, also if that has been blocked."""
    rows, cols = data.draw(st.sampled_from([(1, 5), (2, 3), (3, 3), (3, 2), (4, 1)]))
    line = st.lists(st.sampled_from("...#"), min_size=cols, max_size=cols).map("".join)
    grid = data.draw(st.lists(line, min_size=rows, max_size=rows))
    world = RegionMap.from_grid(grid)
    assume(world.free)
    mobility = data.draw(st.sampled_from([*Mobility]))
    facings = [*Heading] if mobility is Mobility.HEADING else [None]
    poses = [Pose(region, facing) for region in range(rows * cols) for facing in facings]
    here = data.draw(st.sampled_from([pose for pose in poses if pose.region in world.free]))
    blocked = data.draw(st.frozensets(st.sampled_from(world.free), max_size=2))
    lost = data.draw(st.frozensets(st.sampled_from(poses), max_size=2))
    known = tuple(Known(region, "door", "it is closed") for region in sorted(blocked))
    visit = Visit((at(world.free[0]),))
    robot = Robot("a", RobotModel("rover", mobility, "ground", frozenset()), here, visit)
    spec = compile_task(Task(robot, here, visit, blocked=known, forbidden=lost), world)
    rules = [predicate(parse(c.formula)) for c in spec.section(Section.SYS_TRANS)]
    offsets = {(-1, 0): 0, (0, 1): 1, (1, 0): 2, (0, -1): 3}
    for a, b in product(poses, poses):
        if a.region not in world.free:
            continue
        (row, col), (then, beside) = divmod(a.region, cols), divmod(b.region, cols)
        side, stays = offsets.get((then - row, beside - col)), a.region == b.region
        turns = a.heading is None or (a.heading != (side or 0) ^ 2 and b.heading == side)
        possible = a.heading == b.heading if stays else side is not None and turns
        open_ = b.region not in blocked or a.region == b.region == here.region
        expected = possible and grid[then][beside] == "." and open_ and b not in lost
        before, after = ({"region": p.region, "heading": p.heading or 0} for p in (a, b))
        assert all(rule(before, after) for rule in rules) == expected, (a, b)
