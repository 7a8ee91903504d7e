"""Beliefs contain the true position, and the specification says exactly how they develop.

Among the tests the campaigns are short; `make fuzz` tries thousands.
"""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.formula.evaluator import Predicate, predicate
from safenav.formula.parser import parse
from safenav.outcome import Verdict
from safenav.runtime.control.observing import after_look
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Visit
from safenav.scenario.reading.loader import load_scenario
from safenav.spec.compile import compile_task
from safenav.spec.other_robots import belief
from safenav.spec.other_robots.knowledge import Knowledge, occurring, watch
from safenav.spec.specification import Section
from safenav.spec.task import Observed, Task
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.partition import Partition
from safenav.world.poses import bits
from spec.scenes import Scene, scenes, walk
from support.examples import campaign

MOST = 10_000
CASE_STUDY_3 = Path(__file__).parents[2] / "scenarios" / "case_study_3.yaml"


def formulas(scene: Scene, section: Section) -> list[Predicate]:
    found = belief.assumptions(scene.task, scene.world)
    return [predicate(parse(c.formula)) for c in found if c.section is section]


def inputs(scene: Scene, knowledge: Knowledge) -> dict[str, int]:
    return belief.observe(scene.task, scene.world, {"other": knowledge})


@campaign(100)
@given(scenes(), st.data())
def test_the_other_robot_is_always_in_its_believed_region(
    scene: Scene, data: st.DataObject
) -> None:
    seen_by = belief.watch_for(scene.task, scene.world)
    for look in walk(scene, data, 12):
        assert look.other in seen_by.possible(look.knowledge)
        in_sight = seen_by.visibility.sees(look.before, look.other)
        assert (look.knowledge == look.other) == in_sight


@campaign(100)
@given(scenes(), st.data())
def test_observations_satisfy_the_assumptions(scene: Scene, data: st.DataObject) -> None:
    begins, steps = formulas(scene, Section.ENV_INIT), formulas(scene, Section.ENV_TRANS)
    own = scene.task.pose.region
    state = {"region": own, **inputs(scene, belief.known_of(scene.task.observed[0]))}
    assert all(formula(state, None) for formula in begins)
    for look in walk(scene, data, 12):
        following = {"region": look.after, **inputs(scene, look.knowledge)}
        assert all(formula(state, following) for formula in steps)
        state = following


@campaign(60)
@given(scenes(), st.data())
def test_a_specification_can_begin_with_a_belief(scene: Scene, data: st.DataObject) -> None:
    """As when a robot is resynthesized while the other is out of sight."""
    looks = walk(scene, data, 8)
    knowledge, own, where = looks[3].knowledge, looks[3].after, looks[3].other
    cells = knowledge if isinstance(knowledge, frozenset) else None
    again = Observed("other", where, cells)
    task = replace(scene.task, pose=Pose(own), observed=(again,))
    later = Scene(scene.world, task)
    state = {"region": own, **inputs(later, knowledge)}
    assert all(formula(state, None) for formula in formulas(later, Section.ENV_INIT))
    steps = formulas(later, Section.ENV_TRANS)
    for look in looks[4:]:
        following = {"region": look.after, **inputs(later, look.knowledge)}
        assert all(formula(state, following) for formula in steps)
        state = following


@settings(max_examples=15, deadline=None)
@given(scenes())
def test_the_assumptions_allow_exactly_the_possible_observations(scene: Scene) -> None:
    """For whatever can be known anywhere, all next inputs are tried."""
    (model,) = belief.models(scene.task, scene.world)
    steps = formulas(scene, Section.ENV_TRANS)
    values = range(scene.world.size + len(model.beliefs))
    for knowledge, owns in model.owns.items():
        for own in bits(owns):
            prospect = model.watch.update(own, knowledge)
            expected = set(prospect.seen)
            if prospect.belief is not None:
                expected.add(model.number(prospect.belief))
            state = {"region": own, "at_other": model.number(knowledge)}
            allowed = {
                value
                for value in values
                if all(f(state, {"region": own, "at_other": value}) for f in steps)
            }
            assert allowed == expected


@campaign(60)
@given(scenes(), st.data())
def test_knowledge_develops_as_defined(scene: Scene, data: st.DataObject) -> None:
    """The definition, word by word: successors in sight are exact, the others fold into the
    set of cells that contain one."""
    world, seen_by = scene.world, belief.watch_for(scene.task, scene.world)
    cells = seen_by.partition.cells
    believed = st.frozensets(st.integers(0, len(cells) - 1), min_size=1)
    knowledge = data.draw(st.sampled_from(world.free) | believed)
    own = data.draw(st.sampled_from(world.free))
    if isinstance(knowledge, frozenset):
        now = {region for cell in knowledge for region in cells[cell]}
    else:
        now = {knowledge}
    after = now | {near for region in now for near in world.neighbours(region)}
    sight = seen_by.visibility.from_(own)
    prospect = seen_by.update(own, knowledge)
    assert prospect.seen == after & sight
    unseen = {index for index, cell in enumerate(cells) if cell & after - sight}
    assert prospect.belief == (frozenset(unseen) or None)


@settings(max_examples=60, deadline=None)
@given(scenes())
def test_inputs_occur_iff_some_joint_path_leads_to_them(scene: Scene) -> None:
    """The fixpoint over sets of own regions, against one pair at a time."""
    world, task = scene.world, scene.task
    seen_by = belief.watch_for(task, world)
    blocked = {known.region for known in task.blocked}
    start = (task.pose.region, belief.known_of(task.observed[0]))
    found, fresh = {start}, [start]
    while fresh:
        own, knowledge = fresh.pop()
        prospect = seen_by.update(own, knowledge)
        after: set[Knowledge] = set(prospect.seen)
        if prospect.belief is not None:
            after.add(prospect.belief)
        steps = [own, *(r for r in world.neighbours(own) if r not in blocked)]
        new = {(step, known) for step in steps for known in after} - found
        found |= new
        fresh += new
    masks = occurring(seen_by, start[0], frozenset(blocked), start[1], MOST)
    assert {(own, known) for known, owns in masks.items() for own in bits(owns)} == found


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
