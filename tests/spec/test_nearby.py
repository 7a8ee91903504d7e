"""Strategies that avoid others as occupied neighbouring regions, against others at random."""

from random import Random

import pytest

from safenav.outcome import Verdict
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Visit
from safenav.spec.compile import assumption_names, compile_task
from safenav.spec.other_robots.nearby import busy
from safenav.spec.task import Task
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose

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
