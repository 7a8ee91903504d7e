"""Runs of case files (``facts.py`` has their keys) and of the shipped scenarios, on both clocks."""

import json
import sys
from pathlib import Path
from random import Random

import pytest
from msgspec.structs import replace

from children import ran
from once import SCENARIOS, trace_of_shipped
from runtime.facts import Facts, cases, hold
from runtime.played import Run, completed
from safenav import Clock, Mission, Scenario, check_trace, load_scenario
from safenav.batch.case import Ledger, differences
from safenav.trace.file import read_bytes
from support.durations import Uneven

SHIPPED = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))
LIVE = [
    *("case_study_2", "beam", "corridor_swap", "team_of_six"),
    *("night_round", "parked_robot", "warehouse_orders", "battery_delivery"),
]


@pytest.mark.parametrize(("text", "facts"), [*cases()])
def test_a_case_has_the_stated_facts(text: str, facts: Facts) -> None:
    hold(text, facts)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_the_audit_accepts_the_run_of_each_shipped_scenario(name: str) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    assert scenario.expect.outcome is not None
    file = trace_of_shipped(name)
    audit = check_trace(file)
    assert audit.findings == (), "\n".join(map(str, audit.findings))
    assert audit.complete
    ledger = Ledger()
    for record in read_bytes(file.read_bytes()).records:
        ledger(record)
    assert differences(scenario.expect, ledger) == []


def live(name: str) -> Scenario:
    return replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)


@pytest.mark.parametrize("name", LIVE)
def test_shipped_scenarios_complete_in_time(name: str) -> None:
    scenario, run, ledger = live(name), Run(), Ledger()
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
    scenario, draw = live(f"case_study_{1 + seed}_beliefs"), Random(seed)
    speeds = {robot.name: draw.uniform(0.5, 2) for robot in scenario.robots}
    world = Uneven(scenario, speeds=speeds, delayed=0.2, seed=seed)
    run = completed(scenario, world=world)
    assert not run.all("assumption")
    assert run.all("belief", seen=True) and run.all("belief", seen=False)


def test_a_run_repeats_with_other_hashes_and_with_cached_strategies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Robots are examined in the scenario's order, so the same one is named in each process."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))
    told, cached = [], []
    for name, clock in (("night_round", "live"), ("case_study_3", "lockstep")):
        for seed in "01":
            monkeypatch.setenv("PYTHONHASHSEED", seed)
            trace = tmp_path / f"{seed}.jsonl"
            words = (SCENARIOS / f"{name}.yaml", "--clock", clock, "--trace", trace)
            assert ran([sys.executable, "-m", "safenav", "run", *words]).returncode == 0
            lines = [json.loads(line) for line in trace.read_text().splitlines()]
            kept = ("plan", "move", "depart", "arrive")
            told.append([line for line in lines if line["type"] in kept])
            cached.append({line["cached"] for line in lines if line["type"] == "synthesis"})
    assert told[0] == told[1] and told[2] == told[3]
    assert any(line["type"] == "plan" for line in told[0]) and told[2]
    assert cached[2:] == [{False}, {True}]
