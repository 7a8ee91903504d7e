"""The automaton of an objective and its formulas say the same, step by step; strategies of visits
keep their order, and those that avoid others never meet them."""

from itertools import product
from pathlib import Path
from random import Random

import pytest

from safenav.errors import Verdict
from safenav.formula.parser import parse
from safenav.formula.syntax import evaluate
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Cover, Hold, Once, Patrol, TargetObjective, Visit
from safenav.spec.compile import assumption_names, busy, compile_task, encode
from safenav.spec.specification import Section
from safenav.spec.task import NO_MEMORY, Memory, Task
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure
from safenav.world.map import Heading, RegionMap
from safenav.world.poses import Mobility, Pose, bits, plain_graph

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
def test_a_step_is_allowed_and_counts_as_by_the_formulas(
    objective: TargetObjective,
) -> None:
    pursuit = objective
    # A visit has a memory where goals are assigned at runtime; see below.
    encoding = encode(objective, "robots.r", 3, NO_MEMORY, assigned=True)
    parsed = [(c.section, parse(c.formula)) for c in encoding.constraints]
    rules = [formula for section, formula in parsed if section is Section.SYS_TRANS]
    goals = [formula for section, formula in parsed if section is Section.SYS_LIVENESS]
    memories = range(len(pursuit.targets)) if pursuit.in_turn else (0,)
    steps = 0
    for memory, region, then, after in product(memories, REGIONS, memories, REGIONS):
        before, now = values(memory, region), values(then, after)
        if objective.strict and pursuit.begin(region, memory) != memory:
            continue  # a state that the formulas never let it be in
        kept = all(evaluate(rule, before, now) for rule in rules)
        turned = pursuit.turned(memory, region) if pursuit.in_turn else memory
        assert kept == (then == turned and not pursuit.forbidden(memory, region, after))
        if kept:
            met = tuple(i for i, goal in enumerate(goals) if evaluate(goal, before, now))
            counts = pursuit.met(then, after)
            if pursuit.in_turn and pursuit.settles:  # the last one alone is a goal forever
                counts = (0,) if len(pursuit.targets) - 1 in counts else ()
            assert met == counts
            steps += 1
    assert steps > 20


@pytest.mark.parametrize("objective", OBJECTIVES[:7], ids=str)
def test_it_starts_as_the_formulas_require(objective: Patrol | Visit) -> None:
    pursuit = objective
    for region, memory in product(REGIONS, range(len(pursuit.targets))):
        encoding = encode(objective, "robots.r", region, Memory(memory), assigned=True)
        start = values(pursuit.begin(region, memory), region)
        for constraint in encoding.constraints:
            if constraint.section is Section.SYS_INIT:
                assert evaluate(parse(constraint.formula), start, {})


def test_a_cover_ends_its_round_when_all_targets_were_met() -> None:
    pursuit = Cover((at(0), at(8), at(4)))
    memory = 0
    for region, left in ((8, [0, 2]), (8, [0, 2]), (3, [0, 2]), (0, [2]), (4, [0, 1, 2])):
        memory = pursuit.turned(memory, region)
        assert [*bits(pursuit.pursuit.awaited(memory))] == left


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
        steps = 1 if here & plain.on(visit.targets[memory]) else 0
        steps = (
            steps
            or plain.steps_between(here, plain.on(visit.targets[memory]), plain.everywhere)
            or 0
        )
        for _ in range(steps):  # the shortest way to the next target, or a stay at it
            (node,) = strategy.transitions[node]
            now = strategy.values(node)
            facing = Heading(now["heading"]) if heading is not None else None
            here = 1 << plain.number(Pose(now["region"], facing))
            if now["region"] in visit.targets[memory]:
                break
        assert strategy.values(node)["region"] in visit.targets[memory]


WORLD = RegionMap.from_grid([".....", ".###.", "....."])


@pytest.mark.parametrize("names", [("b",), ("b", "c")], ids=len)
def test_it_never_enters_an_occupied_region_and_meets_its_targets(names: tuple[str, ...]) -> None:
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
