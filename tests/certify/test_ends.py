"""Bundles of unusual runs: in external or changed worlds, ended early, or in metres."""

import json
import shutil
from pathlib import Path
from random import Random

import pytest

from certify.making import SCENARIOS, files_of, judged, rewrite, shipped
from certify.mutants import lines_of, with_lines
from runtime.worlds import Driven
from safenav import Mission, TraceWriter, load_scenario
from safenav.certify.record import bundle_of_run, bundle_of_trace
from safenav.errors import NotCertifiedError
from safenav.runtime.intervention.kinds import AssignObjective
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.scenario.model import Robot, Scenario
from safenav.scenario.objective import Visit
from safenav.world.moves import Pose


class Slippery(Driven):
    """A world in which a robot sometimes ends in another region than commanded."""

    def __init__(self, scenario: Scenario, chance: Random) -> None:
        super().__init__(scenario)
        self._free = sorted(scenario.map.free)
        self._chance = chance
        self._at = {robot.name: robot.start.region for robot in scenario.robots}

    def move(self, robot: Robot, pose: Pose) -> Pose:
        if self._chance.random() < 0.03:
            taken = {*self._at.values(), *self.truth.standing()}
            pose = Pose(
                self._chance.choice([r for r in self._free if r not in taken]), pose.heading
            )
        super().move(robot, pose)
        self._at[robot.name] = pose.region
        return pose


COUNTING = """
safenav: 1
map: {{grid: ["####", "#..#", "#..#", "####"]}}
robots:
  a:
    model: quadcopter
    start: 5
    objective:
      avoid: {avoid}
      ltl:
        memory: {{n: [0, 1]}}
        init: [n = 0]
        safety: ["n' = n | region' = 6"]
        liveness: [n = 1]
  b: {{model: quadcopter, start: 10, objective: {{patrol: [10, 6]}}}}
until: {{rounds: 1}}
limits: {{ticks: 30}}
"""
"""A counter that only region 6 changes."""


@pytest.mark.parametrize("avoid", [[], [6]], ids=["possible", "impossible"])
def test_the_limits_of_a_robot_alone_are_claimed_without_the_others(
    avoid: list[int], tmp_path: Path
) -> None:
    scenario = tmp_path / "counting.yaml"
    scenario.write_text(COUNTING.format(avoid=avoid))
    made = bundle_of_run(scenario, tmp_path / "bundle")
    claims = {claim["kind"]: claim["text"] for claim in made.verdict.claims}
    if avoid:
        assert "even without other robots" in claims["unrealizable"]
        assert "never began" in claims["outcome"]
    else:
        assert "unrealizable" not in claims


@pytest.mark.parametrize("seed", [0, 1])
def test_a_bundle_names_the_assumption_that_failed(seed: int, tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / "case_study_3_beliefs.yaml")
    trace = tmp_path / "run.jsonl"
    with TraceWriter(trace) as writer:
        world = Slippery(scenario, Random(f"straycase_study_3_beliefs{seed}"))
        Mission(scenario, world=world, listeners=[writer]).run()
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    failed = [line for line in lines if line["type"] == "assumption"]
    made = bundle_of_trace(trace, tmp_path / "bundle")
    said = [claim for claim in made.verdict.claims if claim["kind"] == "broken"]
    assert len(said) == len(failed) > 0
    assert "which ended elsewhere than commanded" in str(made.verdict.claims)


def test_another_objective_during_the_run_is_claimed(tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / "hello.yaml")
    trace = tmp_path / "run.jsonl"
    targets = (frozenset({scenario.robots[0].start.region}),)
    with TraceWriter(trace) as writer:
        mission = Mission(scenario, world=SimulatedWorld(scenario), listeners=[writer])
        mission.start()
        mission.step()
        mission.intervene(AssignObjective(scenario.robots[0].name, Visit(targets)))
        while mission.result is None:
            mission.step()
    made = bundle_of_trace(trace, tmp_path / "bundle")
    assert "changed" in [claim["kind"] for claim in made.verdict.claims]


def test_a_bundle_claims_a_limit_only_if_the_run_reached_it(tmp_path: Path) -> None:
    scenario = tmp_path / "short.yaml"
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    scenario.write_text(text.replace("ticks: 500", "ticks: 9").split("expect:")[0])
    made = bundle_of_run(scenario, tmp_path / "bundle")
    assert "ended at its limit of 9 ticks" in str(made.verdict.claims)
    files = files_of(tmp_path / "bundle")
    lines = files["trace.jsonl"].splitlines(keepends=True)
    kept = [line for line in lines if b'"tick":9' not in line]
    end = lines[-1].replace(b'"tick":9', b'"tick":8').replace(b'"ticks":9', b'"ticks":8')
    forged = rewrite(
        tmp_path / "bundle", {**files, "trace.jsonl": b"".join([*kept, end])}, tmp_path / "forged"
    )
    status, said = judged(forged)
    assert status == 1
    assert "the limit of 9 ticks is not reached" in said


def test_a_bundle_contains_the_motion_of_its_run(tmp_path: Path) -> None:
    bundle_of_run(SCENARIOS / "hello.yaml", tmp_path / "hello", motion=True)
    status, said = judged(tmp_path / "hello")
    assert status == 0, said
    assert "not compared: the motion (safenav check)" in said
    moved, trace = tmp_path / "hello" / "motion.jsonl", tmp_path / "hello" / "trace.jsonl"
    bundle_of_trace(trace, tmp_path / "again", moved)
    another = shipped("case_study_1") / "trace.jsonl"
    with pytest.raises(NotCertifiedError, match="is not a motion of this run"):
        bundle_of_trace(another, tmp_path / "wrong", moved)
    forged = shutil.copytree(shipped("hello"), tmp_path / "copy")
    files = {**files_of(forged), "motion.jsonl": b'{"type": "header", "trace": "0"}\n'}
    status, said = judged(rewrite(forged, files, tmp_path / "forged"))
    assert status == 1
    assert "the motion of another trace" in said


def test_a_header_with_an_obstacle_around_a_robot_that_it_blocks_is_refused(tmp_path: Path) -> None:
    files = files_of(shipped("case_study_1"))
    lines = lines_of(files)
    quad = lines[0]["scenario"]["robots"]["quad"]["start"]
    door = lines[0]["scenario"]["obstacles"][0]
    lines[0]["scenario"]["obstacles"].append({**door, "name": "gate@0", "region": quad})
    forged = rewrite(shipped("case_study_1"), with_lines(files, lines), tmp_path / "forged")
    status, said = judged(forged)
    assert status == 1
    assert "quad starts at 14 (1, 1) with gate@0" in said
