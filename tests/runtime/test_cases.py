"""Runs of case files (``facts.py`` has their keys) and of the shipped scenarios, on both clocks."""

import json
import sys
from pathlib import Path
from random import Random

import pytest
from msgspec.structs import replace

import warm
from children import ran
from once import SCENARIOS, trace_of_shipped
from runtime.facts import Facts, cases, hold
from runtime.played import Run, completed
from runtime.worlds import Uneven
from safenav import Clock, check_trace, load_scenario
from support.transcripts import golden_row

TALLIES = Path(__file__).with_name("tallies.txt")
SHIPPED = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))
LIVE = [
    *("case_study_2", "beam", "corridor_swap", "team_of_six"),
    *("night_round", "parked_robot", "warehouse_orders", "battery_delivery"),
]


@pytest.mark.parametrize(("text", "facts"), [*cases()])
def test_a_run_has_the_facts_that_its_case_states(
    text: str, facts: Facts, request: pytest.FixtureRequest
) -> None:
    """A change of the tally is one of a behaviour: `make golden` shows which runs it reaches."""
    if run := hold(text, facts):
        golden_row(request.node.callspec.id, run.tally, TALLIES)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_the_judge_accepts_the_run_of_each_shipped_scenario(name: str) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    assert scenario.expect.outcome is not None
    verdict = check_trace(trace_of_shipped(name))
    assert verdict.findings == (), "\n".join(map(str, verdict.findings))
    assert verdict.complete
    lines = map(json.loads, trace_of_shipped(name).read_text().splitlines())
    golden_row(f"shipped {name}", Run(lines).tally, TALLIES)


@pytest.mark.parametrize("name", LIVE)
def test_shipped_scenarios_complete_in_time(name: str, tmp_path: Path) -> None:
    scenario, trace = SCENARIOS / f"{name}.yaml", tmp_path / "t.jsonl"
    done = warm.safenav("run", scenario, "--no-map", "--clock", "live", "--trace", trace)
    assert done.returncode == 0, done.stdout + done.stderr
    assert check_trace(trace).findings == ()
    _, *lines = map(json.loads, trace.read_text().splitlines())
    times = [line["t"] for line in lines]
    assert lines[-1]["outcome"] == "completed"
    assert times == sorted(times) and lines[-1]["makespan"] == pytest.approx(times[-1])
    under_way, together = set(), 0
    for line in lines:
        if line["type"] in ("depart", "arrive"):
            (under_way.add if line["type"] == "depart" else under_way.discard)(line["robot"])
            together = max(together, len(under_way))
    assert together >= 2


@pytest.mark.parametrize("seed", range(3))
def test_beliefs_hold_for_any_durations(seed: int) -> None:
    """Robots at half to double speed, every fifth step five times as long."""
    scenario, draw = load_scenario(SCENARIOS / f"case_study_{1 + seed}_beliefs.yaml"), Random(seed)
    scenario = replace(scenario, clock=Clock.LIVE)
    speeds = {robot.name: draw.uniform(0.5, 2) for robot in scenario.robots}
    world = Uneven(scenario, speeds=speeds, delayed=0.2, seed=seed)
    run = completed(scenario, world=world)
    assert not run.all("assumption")
    assert run.all("belief", seen=True) and run.all("belief", seen=False)


def test_a_run_is_the_same_with_other_hashes_and_with_cached_strategies(
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
