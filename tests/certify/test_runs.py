"""Bundles of unusual runs: in external or changed worlds, in seconds, ended early, or in metres."""

import json
from collections import Counter
from functools import cache
from pathlib import Path
from random import Random

import pytest
from msgspec.structs import replace

from certify.making import SCENARIOS, certified, files_of, judged, lines_of, rewrite, with_lines
from certify.tasks import scenario_of, task_of, verdict_of
from once import made_once
from runtime.worlds import Driven
from safenav import Mission, TraceWriter, load_scenario
from safenav.certify.bundle import bundle_of_run, bundle_of_trace
from safenav.errors import UsageError
from safenav.scenario.model import Clock, Robot, Scenario
from safenav.spec.compile import compile_task
from safenav.spec.specification import Specification
from safenav.world.poses import Pose


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


def test_a_bundle_names_the_assumption_that_failed(tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / "case_study_3_beliefs.yaml")
    trace = tmp_path / "run.jsonl"
    with TraceWriter(trace) as writer:
        world = Slippery(scenario, Random("straycase_study_3_beliefs0"))
        Mission(scenario, world=world, listeners=[writer]).run()
    failed = trace.read_text().count('"type":"assumption"')
    made = bundle_of_trace(trace, tmp_path / "bundle")
    said = [claim for claim in made.verdict.claims if claim["kind"] == "broken"]
    assert len(said) == failed > 0
    assert "which ended elsewhere than commanded" in str(made.verdict.claims)


COUNTING = """
map: {{grid: ["####", "#..#", "#..#", "####"]}}
robots:
  a:
    model: quadcopter
    start: 5
    objective:
      avoid: {0}
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


def test_the_limits_of_a_robot_alone_are_claimed_without_the_others() -> None:
    said = certified(COUNTING.format([6]))
    assert "even without other robots" in said and "never began" in said
    assert "No strategy exists" not in certified(COUNTING.format([]))


def test_a_limit_is_claimed() -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0]
    assert "ended at its limit of 9 ticks" in certified(text.replace("ticks: 500", "ticks: 9"))


@cache
def changed() -> Path:
    """A run in which the quadcopter is out of service for some ticks, a door closes, and the
    humanoid is given other targets."""

    def make(folder: Path) -> None:
        with TraceWriter(folder / "run.jsonl") as writer:
            mission = Mission(load_scenario(SCENARIOS / "case_study_1.yaml"), listeners=[writer])
            mission.start()
            while mission.result is None:
                if mission.tick in (3, 8):
                    mission.intervene(f"service quad {'back' if mission.tick == 8 else 'out'}")
                if mission.tick == 9:
                    mission.intervene({"kind": "close", "type": "door", "region": 44})
                    mission.intervene("objective digit {visit: [58, 71]}")
                mission.step()
        bundle_of_trace(folder / "run.jsonl", folder / "bundle")

    return made_once("bundle of a changed run", make) / "bundle"


def test_a_run_that_was_changed_is_accepted() -> None:
    kinds = {line["type"] for line in lines_of(files_of(changed()))}
    assert kinds >= {"service", "appeared", "objective"}
    status, said = judged(changed())
    assert status == 0, said
    assert "made 4 changes" in said


def test_an_objective_that_was_not_assigned_is_refused(tmp_path: Path) -> None:
    files = files_of(changed())
    lines = [line for line in lines_of(files) if line["type"] != "objective"]
    assert judged(rewrite(with_lines(files, lines), tmp_path / "bundle"))[0] == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["corridor_swap", "case_study_2"])
def test_a_live_run_is_certified(name: str, tmp_path: Path) -> None:
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    with TraceWriter(tmp_path / "run.jsonl") as writer:
        Mission(scenario, listeners=[writer]).run()
    bundle_of_trace(tmp_path / "run.jsonl", tmp_path / "bundle")
    status, said = judged(tmp_path / "bundle")
    assert status == 0, said
    departs = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    by = Counter(line["by"] for line in departs if line["type"] == "depart")
    assert f"Of {by.total()} moves {by['strategy']} follow strategies" in said


def test_a_live_strategy_that_assumes_single_steps_of_others_is_refused(tmp_path: Path) -> None:
    robots = """
        a: {model: rover, start: [1, 1], vision: 2, tracks: [b],
          objective: {visit: [[1, 1], [1, 2]]}}
        b: {model: drone, start: [1, 6], objective: {hold: [1, 6]}}"""
    more = "partition: {tiles: [3, 1]}\nclock: live\n"
    drone = "    drone: {mobility: free, layer: air, capabilities: []}\n"
    scenario = scenario_of("########\n#......#\n########", robots, more, drone)

    def in_ticks(_: Specification) -> Specification:
        return compile_task(replace(task_of(scenario), live=False), scenario.map)

    assert verdict_of(scenario, tmp_path / "bundle") == ""
    assert "which can occur" in verdict_of(scenario, tmp_path / "refused", planted=in_ticks)


def test_goals_that_are_assigned_at_run_time_are_not_certified(tmp_path: Path) -> None:
    scenario = tmp_path / "hello.yaml"
    text = (SCENARIOS / "hello.yaml").read_text()
    scenario.write_text(f"{text}coordination: assignable\n")
    with pytest.raises(UsageError, match="use 'coordination: resynthesis'"):
        bundle_of_run(scenario, tmp_path / "bundle")
