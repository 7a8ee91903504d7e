"""Live runs of shipped scenarios, with other durations, and in other processes; searches without a
verdict. What fails in live runs is ``cases/failures`` and ``test_worlds.py``."""

import json
import os
import subprocess
import sys
from pathlib import Path
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from runtime.facts import case
from runtime.played import Run, completed, loaded, play
from runtime.worlds import Faulty
from safenav import Mission
from safenav.batch.case import Ledger, differences
from safenav.plan import search
from safenav.runtime.control.answers import Answers
from safenav.scenario.model import Clock
from safenav.scenario.reading.loader import load_scenario
from safenav.team.floor import Floor
from support.durations import Uneven

SHIPPED = [
    *("case_study_2", "beam", "corridor_swap", "team_of_six"),
    *("night_round", "parked_robot", "warehouse_orders", "battery_delivery"),
]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_complete_in_time(name: str) -> None:
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    run, ledger = Run(), Ledger()
    result = Mission(scenario, listeners=[run, ledger]).run()
    assert result.outcome == "completed", result.explanation
    assert differences(scenario.expect, ledger) == []
    assert not run.findings
    times = [line["t"] for line in run.records[1:]]
    assert times == sorted(times) and result.makespan == pytest.approx(times[-1])
    under_way, together = set(), 0
    for line in run.records:
        if line["type"] in ("depart", "arrive"):
            (under_way.add if line["type"] == "depart" else under_way.discard)(line["robot"])
            together = max(together, len(under_way))
    assert together >= 2


@pytest.mark.parametrize("seed", range(3))
def test_beliefs_hold_for_any_durations(seed: int) -> None:
    """Robots at half to double speed, every fifth step five times as long."""
    name = f"case_study_{1 + seed}_beliefs"
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    draw = Random(seed)
    speeds = {robot.name: draw.uniform(0.5, 2) for robot in scenario.robots}
    world = Uneven(scenario, speeds=speeds, delayed=0.2, seed=seed)
    run = completed(scenario, world=world)
    assert not run.all("assumption")
    assert run.all("belief", seen=True) and run.all("belief", seen=False)


def test_an_exhausted_search_names_the_robot_out_of_service(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only an operator brings the robot back, whatever plan another search would find."""
    plan = Answers.plan

    def spent(answers: Answers, floor: Floor, *about: Any) -> Any:
        return plan(answers, floor, *about) if 0 in floor.robots else None

    monkeypatch.setattr(Answers, "plan", spent)
    scenario, run = loaded(case("failures/ring")), Run()
    Mission(scenario, world=Faulty(scenario, [["a", 1, "fatal"]]), listeners=[run]).run()
    outcome = run.outcome
    assert (outcome["outcome"], outcome["cause"]) == ("operator_needed", "out_of_service")
    assert outcome["explanation"].startswith("a (its steps fail) out of service; search budget")


def test_a_proof_that_exceeds_its_budget_is_not_a_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "PROOF", 1)
    monkeypatch.setattr(search, "SINGLES", 1)
    assert play(case("objectives/once_with_a_trapped_helper")).outcome["outcome"] == "search_limit"


def test_a_simulated_run_does_not_depend_on_the_hashes_of_a_process(tmp_path: Path) -> None:
    """Robots are examined in the scenario's order, so the same one is named in each process."""
    run = "import sys; from safenav.cli import main; sys.argv[0] = 'safenav'; main()"
    scenario = SCENARIOS / "night_round.yaml"
    told = []
    for seed in "01":
        trace = tmp_path / f"{seed}.jsonl"
        words = ["run", str(scenario), "--clock", "live", "--trace", str(trace)]
        subprocess.run(
            [sys.executable, "-c", run, *words],
            env={**os.environ, "PYTHONHASHSEED": seed},
            stdout=subprocess.DEVNULL,
            check=True,
        )
        lines = map(json.loads, trace.read_text().splitlines())
        told.append([(line["reason"], line["robots"]) for line in lines if line["type"] == "plan"])
    assert told[0] == told[1]
    assert told[0]
