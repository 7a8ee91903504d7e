"""The automaton of an objective and its formulas say the same, step by step."""

from itertools import product

import pytest

from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.scenario.objective import Cover, Hold, Once, Patrol, TargetObjective, Visit
from safenav.spec.objective import NO_MEMORY, Memory, encode
from safenav.spec.specification import Section

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
    return {"region": region, "scout": memory, "goal": memory}


@pytest.mark.parametrize("objective", OBJECTIVES, ids=str)
def test_a_step_is_allowed_and_counts_as_the_formulas_say(
    objective: TargetObjective,
) -> None:
    pursuit = objective
    encoding = encode(objective, "robots.r", 3, NO_MEMORY)
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
            if pursuit.in_turn and pursuit.settles:  # the last one alone is a goal for ever
                counts = (0,) if len(pursuit.targets) - 1 in counts else ()
            assert met == counts
            steps += 1
    assert steps > 20


@pytest.mark.parametrize("objective", OBJECTIVES[:7], ids=str)
def test_it_begins_as_the_formulas_begin(objective: Patrol | Visit) -> None:
    pursuit = objective
    for region, memory in product(REGIONS, range(len(pursuit.targets))):
        encoding = encode(objective, "robots.r", region, Memory(memory))
        start = values(pursuit.begin(region, memory), region)
        for constraint in encoding.constraints:
            if constraint.section is Section.SYS_INIT:
                assert evaluate(parse(constraint.formula), start, {})


def test_a_cover_ends_its_round_when_all_targets_were_met() -> None:
    pursuit = Cover((at(0), at(8), at(4)))
    memory = 0
    for region, left in ((8, {0, 4}), (8, {0, 4}), (3, {0, 4}), (0, {4}), (4, {0, 4, 8})):
        memory = pursuit.turned(memory, region)
        assert pursuit.awaited(memory) == left
