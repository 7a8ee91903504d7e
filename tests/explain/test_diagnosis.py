"""Graph search against the synthesizer, which must agree on what a robot alone can do; starts
that are proposed."""

import re
from random import Random

from msgspec.structs import replace

from explain.games import drawn_scenario
from once import SCENARIOS
from safenav import RegionMap, Synthesizer, Task, Verdict, compile_task, load_scenario_text
from safenav.explain.explanation import (
    NoStrategyCause,
    RepairProblem,
    diagnose,
    explain_unrealizable,
    play,
)
from safenav.explain.repair import find_repairs
from safenav.scenario.objective import Ltl, describe
from safenav.spec.task import NO_MEMORY, Known

GAMES = 150


def _random_task(source: Random) -> tuple[Task, RegionMap]:
    """A robot with targets, and perhaps known obstacles."""
    while isinstance((scenario := drawn_scenario(source)).robots[0].objective, Ltl):
        pass
    robot, free = scenario.robots[0], sorted(scenario.map.free)
    objective = replace(robot.objective, always=())
    blocked = tuple(Known(r, "obstacles.door", "closed") for r in free if source.random() < 0.1)
    return Task(robot, robot.start, objective, blocked=blocked), scenario.map


def test_the_diagnosis_of_a_lone_robot_agrees_with_the_synthesizer() -> None:
    source = Random(5)
    tasks = [_random_task(source) for _ in range(GAMES)]
    verdicts = Synthesizer().synthesize_all(
        [compile_task(task, world) for task, world in tasks], strategy=False
    )
    for (task, world), result in zip(tasks, verdicts, strict=True):
        blocked = frozenset(known.region for known in task.blocked)
        solo = play(task.robot.model.mobility, task.pose, task.objective, NO_MEMORY, world, blocked)
        said = f"{describe(task.objective)} from {task.pose} on {world.grid_rows()} {blocked}"
        assert solo.winnable == (result.verdict is Verdict.REALIZABLE), said
        assert (diagnose(task, world).cause is None) == solo.winnable, said
        assert describe(task.objective) in explain_unrealizable(task.robot, task, world)
    assert {result.verdict for result in verdicts} == {Verdict.REALIZABLE, Verdict.UNREALIZABLE}


def test_no_start_is_proposed_that_the_loader_refuses() -> None:
    """From where a battery reaches no charger, in an obstacle, in a region to avoid."""
    scenario = load_scenario_text(
        """
safenav: 1
map: {grid: ["#########", "#...#...#", "#########"]}
robots: {r: {model: cell, start: 10, objective: {visit: [14, 16], avoid: [11]}}}
chargers: [12]
obstacles: [{type: sliding_door, region: 15}]
catalogue:
  robots:
    cell: {mobility: free, layer: low, capabilities: [push], battery: {capacity: 9, charge: 5}}
""",
        reachable=False,
    )
    (robot,) = scenario.robots
    task = Task(robot, robot.start, robot.objective)
    for chargers, starts in (({12}, []), ({14}, ["14", "16"])):
        plan = replace(scenario, chargers=frozenset(chargers))
        problem = RepairProblem(plan, task, NoStrategyCause.NO_WAY, diagnose(task, plan.map))
        found = find_repairs(problem, lambda _: True)
        assert {repair.kind for repair in found} >= {"open_wall"}
        told = [change for repair in found for change in repair.change]
        assert [value for item, value in told if item == "robots.r.start"] == starts


def test_the_documentation_explains_every_cause() -> None:
    page = (SCENARIOS.parent / "docs" / "explain.md").read_text(encoding="utf-8")
    named = re.findall(r"`(\w+)`", page.split("| cause |")[1].split("\n\n")[0])
    assert {cause.value for cause in NoStrategyCause} <= set(named)
