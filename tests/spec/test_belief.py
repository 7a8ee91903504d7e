"""Beliefs contain the true position, and the specification says exactly how they develop.

Among the tests the campaigns are short; `make fuzz` tries thousands.
"""

from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from safenav.errors import UsageError, Verdict
from safenav.formula.parser import parse
from safenav.formula.syntax import Predicate, predicate
from safenav.runtime.control.strategies import after_look
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Visit
from safenav.scenario.reading.loader import load_scenario
from safenav.spec import belief
from safenav.spec.belief import Knowledge, watch
from safenav.spec.compile import compile_task
from safenav.spec.specification import Section
from safenav.spec.task import Observed, Task
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure
from safenav.world.map import Partition, Region, RegionMap
from safenav.world.poses import Mobility, Pose, bits
from spec.scenes import Oracle, Scene, scenes
from support.examples import campaign

CASE_STUDY_3 = Path(__file__).parents[2] / "scenarios" / "case_study_3.yaml"


def formulas(scene: Scene, section: Section) -> list[Predicate]:
    found = belief.assumptions(scene.task, scene.world)
    return [predicate(parse(c.formula)) for c in found if c.section is section]


@campaign(40)
@given(scenes())
def test_the_assumptions_allow_exactly_the_possible_observations(scene: Scene) -> None:
    """All that can be known, everywhere where the robot can get to; all inputs are tried."""
    assume(len(scene.world.free) <= 16)
    world, task, oracle = scene.world, scene.task, Oracle(scene)
    (model,) = belief.models(task, world)
    number = {model.number(known): known for known in model.owns}
    steps = formulas(scene, Section.ENV_TRANS)
    start: tuple[int, Knowledge] = (task.pose.region, task.observed[0].region)
    found, fresh = {start}, [start]
    while fresh:
        own, known = fresh.pop()
        state = {"region": own, "at_other": model.number(known)}
        allowed = {
            number.get(value)
            for value in range(world.size + len(model.beliefs))
            if all(f(state, {"region": own, "at_other": value}) for f in steps)
        }
        expected = oracle.next(own, known)
        assert allowed == expected
        new = {(after, known) for after in oracle.steps(own) for known in expected} - found
        found |= new
        fresh += new
    assert {(own, known) for known, owns in model.owns.items() for own in bits(owns)} == found


@campaign(60)
@given(scenes(), st.data())
def test_the_other_robot_is_always_in_its_believed_region(
    scene: Scene, data: st.DataObject
) -> None:
    """Its observations satisfy the assumptions, also those of a specification that begins while it
    is out of sight."""
    world, task, oracle = scene.world, scene.task, Oracle(scene)
    watch, own, other = belief.watch_for(task, world), task.pose.region, task.observed[0].region
    knowledge: Knowledge = other
    for turn in range(8):
        if turn in (0, 4):
            cells = knowledge if isinstance(knowledge, frozenset) else None
            task = replace(task, pose=Pose(own), observed=(Observed("other", other, cells),))
            scene = Scene(world, task)
            steps = formulas(scene, Section.ENV_TRANS)
            state = {"region": own, **belief.observe(task, world, {"other": knowledge})}
            assert all(formula(state, None) for formula in formulas(scene, Section.ENV_INIT))
        for _ in range(data.draw(st.integers(0, 6 if task.live else 1))):
            other = data.draw(st.sampled_from(oracle.beside(other) or [other]))
        knowledge = after_look(watch, own, other, knowledge)
        assert other in watch.possible(knowledge)
        assert (knowledge == other) == oracle.sees(own, other)
        after = data.draw(st.sampled_from(oracle.steps(own)))
        following = {"region": after, **belief.observe(task, world, {"other": knowledge})}
        assert all(formula(state, following) for formula in steps)
        own, state = after, following


@pytest.mark.parametrize(("live", "cells"), [(False, {1}), (True, {1, 2})])
def test_one_that_has_stepped_out_of_sight_may_be_far_in_a_live_run(
    live: bool, cells: set[int]
) -> None:
    world = RegionMap.from_grid(["...."])
    partition = Partition.of([[0, 1], [2], [3]])
    assert watch(world, partition, 1.0, frozenset(), live).update(0, 1).belief == cells


def test_numbers_go_to_beliefs_that_can_occur() -> None:
    """Where everything is in sight there is nothing to believe."""
    world = RegionMap.from_grid(["....", "...."])
    (variable,) = belief.inputs(_task(), world)
    assert variable.bounds == (0, 7)


def test_too_many_beliefs_are_refused_with_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(belief, "MOST_BELIEFS", 3)
    scenario = load_scenario(CASE_STUDY_3)
    task = _tracking(scenario.robot("digit"), "quad", 49, radius=2.5)
    with pytest.raises(UsageError, match=r"digit: with 3 cells .* larger tiles"):
        compile_task(task, scenario.map)


def test_a_jump_out_of_sight_leaves_nothing_known() -> None:
    world = RegionMap.from_grid(["......"])
    here = watch(world, Partition.of([[0, 1, 2], [3, 4, 5]]), 2.0)
    assert after_look(here, 1, 5, 1) == {0, 1}
    assert after_look(here, 1, 3, 1) == 3


def test_a_map_of_64_regions_that_all_are_in_sight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is no belief, and no value of the input beyond the regions."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path))
    world = RegionMap.from_grid(["........"] * 8)
    result = Synthesizer(verifier=first_failure).synthesize(compile_task(_task(), world))
    assert result.verdict is Verdict.REALIZABLE
    assert result.verified


def _tracking(
    robot: Robot,
    other: str,
    region: Region,
    radius: float,
) -> Task:
    seeing = replace(robot, model=replace(robot.model, vision=radius))
    observed = (Observed(other, region),)
    return Task(
        seeing,
        robot.start,
        robot.objective,
        observed=observed,
    )


def _task() -> Task:
    """A robot in the first region with unlimited sight, and another in the fourth."""
    model = RobotModel("rover", Mobility.FREE, "ground", frozenset())
    objective = Visit((frozenset({0}), frozenset({1})))
    return Task(
        Robot("rover", model, Pose(0), objective),
        Pose(0),
        objective,
        observed=(Observed("other", 3),),
    )
