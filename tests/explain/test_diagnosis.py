"""Graph search against the synthesizer, which must agree on what a robot alone can do."""

import re
from random import Random

from msgspec.structs import replace

from explain.games import drawn_scenario
from once import SCENARIOS
from safenav import RegionMap, Synthesizer, Task, Verdict, compile_task
from safenav.explain.explanation import NoStrategyCause, diagnose, explain_unrealizable, play
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


def test_the_documentation_explains_every_cause() -> None:
    page = (SCENARIOS.parent / "docs" / "explain.md").read_text(encoding="utf-8")
    named = re.findall(r"`(\w+)`", page.split("| cause |")[1].split("\n\n")[0])
    assert {cause.value for cause in NoStrategyCause} <= set(named)
