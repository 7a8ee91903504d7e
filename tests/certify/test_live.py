"""Runs in time, certified: bundles of shipped runs, told in seconds."""

import json
from collections import Counter
from pathlib import Path

import pytest
from msgspec.structs import replace

from certify.making import SCENARIOS, files_of, judged, rewrite, shipped
from certify.mutants import lines_of, with_lines
from certify.tasks import scenario_of, task_of, verdict_of
from judge.living import living
from safenav import Mission, TraceWriter, load_scenario
from safenav.certify.record import bundle_of_trace
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.spec.compile import compile_task
from safenav.spec.specification import Specification


@pytest.mark.parametrize("name", ["hello", "case_study_2", "corridor_swap"])
def test_a_run_in_seconds_is_followed_as_one_in_ticks(name: str, tmp_path: Path) -> None:
    bundle = shipped(name)
    files = with_lines(files_of(bundle), [*living(lines_of(files_of(bundle)))])
    files.pop("motion.jsonl", None)
    status, said = judged(rewrite(bundle, files, tmp_path / "bundle"))
    assert status == 0, said


TOTES = "totes"
DELIVERIES = """\
safenav: 1
coordination: assignable
map: {grid: ["###########", "#.........#", "#.###.###.#", "#.........#", "###########"]}
catalogue:
  robots: {amr: {mobility: free, layer: ground, capabilities: [lift, drop, push]}}
  obstacles:
    tote: {needs: [{action: lift, at: [12]}, {action: drop, at: [42], same: true}], blocks: []}
robots:
  p: {model: amr, start: [1, 9], objective: {visit: [[1, 9], [3, 1]]}}
  q: {model: amr, start: [3, 5], objective: {patrol: [[3, 5], [1, 5]]}}
obstacles: [{type: door, region: [2, 5]}]
orders: [{at: 2, type: tote, region: 12}, {at: 2, type: tote, region: 12}]
until: {rounds: 1}
limits: {ticks: 300}
"""
"""A robot is told something else in the turn in which it acts."""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["corridor_swap", "case_study_2", TOTES])
def test_a_live_run_is_certified(name: str, tmp_path: Path) -> None:
    if name == TOTES:
        scenario = load_scenario_text(DELIVERIES)
    else:
        scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    scenario = replace(scenario, clock=Clock.LIVE)
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
