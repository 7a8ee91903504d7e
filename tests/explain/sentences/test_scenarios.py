"""What ``safenav explain`` claims about a robot of a random scenario is checked by brute force.
``SAFENAV_FUZZ=60`` tries so many."""

import os
from collections.abc import Callable
from random import Random

import pytest
import yaml
from msgspec.structs import replace

from explain.sentences.judge import Judge, Line, realizable, realizable_together
from explain.sentences.scenarios import as_oracle, formula_of, mission
from safenav.errors import InputError
from safenav.explain.explanation import (
    CoreMember,
    Explanation,
    LosingPlay,
    NoStrategyCause,
    PlayEnd,
)
from safenav.report.terminal.explanation_text import explanation_lines
from safenav.review.postmortem import explain_team
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.spec.compile import compile_task
from safenav.spec.specification import Constraint
from safenav.world.map import Heading, RegionMap
from safenav.world.poses import Pose, moves

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 8


def unrealizable(source: Random) -> tuple[Scenario, Explanation]:
    while True:
        data = mission(source)
        try:
            scenario = load_scenario_text(yaml.safe_dump(data), "s.yaml", reachable=False)
        except InputError:
            continue
        for found in explain_team(scenario, default_synthesizer(scenario)):
            print(yaml.safe_dump(data), *explanation_lines(found, scenario), sep="\n")
            return scenario, found


@pytest.mark.parametrize("seed", range(COUNT))
def test_every_claim_about_a_robot_is_true(seed: int, played: Callable[[], None]) -> None:
    scenario, found = unrealizable(Random(seed))
    played()
    core = found.core
    spec = as_oracle(compile_task(found.task, scenario.map))
    assert not realizable(spec)
    members = [[_line(c) for c in member.constraints] for member in core.members]
    judge = Judge(spec, [line for lines in members for line in lines])
    assert judge.fails() and core.minimal
    for k in range(len(members)):
        rest = [line for lines in [*members[:k], *members[k + 1 :]] for line in lines]
        assert realizable(judge.with_guarantees(rest)), core.members[k]
    assert core.together == realizable_together(judge.part)
    assert core.all_together == realizable_together(spec)
    assert core.decisive == (not core.vain)
    for member in core.members:
        suffices = suffices_to_omit(member, found, scenario.map)
        assert suffices in (None, member not in core.vain), member
    check_cause(found, judge)
    assert found.play is not None
    check_play(found.play, judge, found, scenario)
    for repair in found.repairs:
        answer = first_results(repair.scenario, default_synthesizer(scenario), names=["r"])["r"]
        assert realizable(as_oracle(compile_task(answer.task, repair.scenario.map))), repair.change


def _line(constraint: Constraint) -> Line:
    return constraint.section.value.lower(), formula_of(constraint)  # type: ignore[return-value]


def suffices_to_omit(member: CoreMember, found: Explanation, world: RegionMap) -> bool | None:
    """Whether the whole is realizable without a member of the core; None for rules of the mobility,
    which the core has with the edge of the map."""
    if member.origin.item == "map":
        opened = replace(world, walls=world.walls - {*member.regions})
        return realizable(as_oracle(compile_task(found.task, opened)))
    if member.origin.item.endswith("mobility"):
        return None
    whole = compile_task(found.task, world)
    return realizable(as_oracle(whole.without(member.constraints)))


def check_cause(found: Explanation, judge: Judge) -> None:
    """Check the sentence that names the cause."""
    sections = {section for section, _ in judge.core}
    items = {member.origin.item for member in found.core.members}
    moving = {"map", "robots.r.mobility"}
    match found.cause:
        case NoStrategyCause.CORNERED:
            assert found.core.together and "sys_liveness" not in sections
        case NoStrategyCause.KEPT_AWAY:
            assert found.core.together and "sys_liveness" in sections
        case NoStrategyCause.IMPOSSIBLE_START:
            assert sections == {"sys_init"}
        case NoStrategyCause.CONTRADICTION:
            assert not found.core.together and not items & moving
        case NoStrategyCause.CONFLICT:
            raise AssertionError("nothing was limited")
        case _:
            assert not realizable_together(judge.spec)


def check_play(play: LosingPlay, judge: Judge, found: Explanation, scenario: Scenario) -> None:
    mobility, world = found.task.robot.model.mobility, scenario.map
    if play.ending is PlayEnd.CONFINED:
        reached, queue = {found.task.pose}, [found.task.pose]
        for pose in queue:
            fresh = [p for p in moves(mobility, pose, world) if p not in reached]
            reached.update(fresh)
            queue += fresh
        literal = found.cause is NoStrategyCause.CROSSING
        regions = {pose.region for pose in reached}
        assert (
            found.diagnosis.confined <= regions if literal else found.diagnosis.confined == regions
        )
        assert literal or any(not target & regions for target in found.task.targets)
        return
    goal = play.goal and formula_of(play.goal)
    judge.check_play(play.ending.value, play.walk, play.cycle, dict(play.pressure), goal)
    for dilemma in play.dilemmas:
        last = play.walk[-1]
        heading = Heading(last["heading"]) if "heading" in last else None
        possible = moves(mobility, Pose(last["region"], heading), world)
        assert Pose(dilemma.region, dilemma.heading) in possible
        assert _line(dilemma.broken) in judge.core
