"""Runs in which nobody lists a strategy: the same moves, each checked, and no process left."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from once import SCENARIOS
from runtime.played import begin, play
from safenav.cli import group
from safenav.errors import SynthesizerError, UsageError
from safenav.runtime.coordination.on_demand import OnDemand
from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Controllers, Limits
from safenav.synthesis.serving.served import Position, ServedMove, ServedStrategy
from synthesis.requests import gone


def mission_on_demand(name: str) -> Mission:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    return Mission(replace(scenario, controllers=Controllers.ON_DEMAND))


def pids_of(mission: Mission) -> list[int]:
    found = []
    for robot in mission.state.robots.values():
        assert robot.planner is not None and isinstance(robot.planner.strategy, OnDemand)
        found.append(robot.planner.strategy.pid)
    return found


@pytest.mark.parametrize("name", ["case_study_2", "case_study_3_beliefs", "beam", "two_digits"])
def test_moves_on_demand_are_those_of_the_explicit_strategy(name: str) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    listed = play(replace(scenario, controllers=Controllers.LISTED))
    found = play(replace(scenario, controllers=Controllers.ON_DEMAND))
    assert found.all("move") == listed.all("move")
    for synthesis in found.all("synthesis"):
        assert synthesis["verified"] == "moves"
        assert (synthesis["states"], synthesis["strategy"]) == (None, None)
    assert {synthesis["verified"] for synthesis in listed.all("synthesis")} == {True}


def test_auto_chooses_explicit_strategies_for_small_specifications(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """digit's strategies have up to 29 states in this run, the quadcopter's at most 14; whether
    the answer comes from the cache makes no difference."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))
    scenario = load_scenario(SCENARIOS / "case_study_2.yaml")
    assert scenario.controllers is Controllers.AUTO
    assert {s["verified"] for s in play(scenario).all("synthesis")} == {True}
    for _ in range(2):
        found = play(replace(scenario, limits=Limits(states=20))).all("synthesis")
        sizes = {synthesis["states"] for synthesis in found}
        assert None in sizes
        assert max(size for size in sizes if size is not None) <= 20
        assert {s["verified"] for s in found if s["states"] is None} == {"moves"}


@pytest.mark.parametrize("given_up", [False, True])
def test_the_processes_end_with_the_run(given_up: bool) -> None:
    mission = mission_on_demand("case_study_1")
    mission.start()
    pids = pids_of(mission)
    while not given_up and mission.result is None:
        mission.step()
    mission.give_up()
    assert all(map(gone, [*pids, *pids_of(mission)]))


def test_a_synthesizer_that_dies_ends_the_run_and_the_trace_says_so() -> None:
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    mission, run = begin(replace(scenario, controllers=Controllers.ON_DEMAND))
    for _ in range(3):
        mission.step()
    first, second = pids_of(mission)
    os.kill(first, signal.SIGKILL)
    with pytest.raises(SynthesizerError, match="ended while it served a strategy"):
        mission.step()
    assert run.outcome is run.records[-1] and run.outcome["outcome"] == "error"
    assert "ended while it served" in run.outcome["explanation"]
    assert not run.findings
    assert gone(second)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_the_processes_end_when_the_run_is_killed(tmp_path: Path, number: signal.Signals) -> None:
    program = (
        "import sys, time\n"
        "sys.path[:0] = sys.argv[1:]\n"
        "from runtime.test_on_demand import mission_on_demand, pids_of\n"
        "mission = mission_on_demand('case_study_1')\n"
        "mission.start()\n"
        "print(*pids_of(mission), flush=True)\n"
        "time.sleep(600)\n"
    )
    tests = str(Path(__file__).parents[1])
    with subprocess.Popen(
        [sys.executable, "-c", program, tests],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=tmp_path,
    ) as owner:
        assert owner.stdout is not None
        pids = [int(word) for word in owner.stdout.readline().split()]
        owner.send_signal(number)
    assert len(pids) == 2
    assert all(map(gone, pids))


def test_a_wrong_move_of_the_synthesizer_ends_the_run_before_it_is_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A synthesizer that would send the quadcopter into a wall."""
    mission = mission_on_demand("case_study_1")
    mission.start()
    before = dict(mission.state.poses)
    honest = ServedStrategy.move

    def lying(self: ServedStrategy, here: Position, inputs: dict[str, int]) -> ServedMove | None:
        move = honest(self, here, inputs)
        assert move is not None
        return ServedMove(Position({**move.to.values, "region": 1}, move.to.goal, 0, None), 0)

    monkeypatch.setattr(ServedStrategy, "move", lying)
    with pytest.raises(SynthesizerError, match="a wrong move for quad: a move that violates"):
        mission.step()
    assert mission.state.poses == before


def on_demand_file(folder: Path) -> Path:
    path = folder / "door.yaml"
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    path.write_text(text + "\ncontrollers: on_demand\n")
    return path


def test_commands_accept_moves_on_demand_or_name_what_they_cannot_do(tmp_path: Path) -> None:
    file, trace = str(on_demand_file(tmp_path)), str(tmp_path / "trace.jsonl")
    runner = CliRunner()
    shown = runner.invoke(group, ["synth", file, "-o", str(tmp_path / "out"), "--plot"])
    assert (shown.exit_code, shown.output.count("each move")) == (0, 4)
    assert "quad: no explicit strategy" in shown.output
    assert {p.suffix for p in (tmp_path / "out").iterdir()} == {".structuredslugs"}
    checked = runner.invoke(group, ["check", file])
    assert checked.exit_code == 0
    assert "no explicit strategy" in checked.output
    assert runner.invoke(group, ["explain", file]).exit_code == 0
    told = runner.invoke(group, ["run", file, "--trace", trace])
    assert told.exit_code == 0
    assert "each move checked" in told.output
    refused = runner.invoke(group, ["certify", file, "-o", str(tmp_path / "bundle.zip")])
    assert isinstance(refused.exception, UsageError)
    assert "certify it with 'controllers: listed'" in str(refused.exception)
    refused = runner.invoke(
        group, ["certify", "--trace", trace, "-o", str(tmp_path / "bundle.zip")]
    )
    assert isinstance(refused.exception, UsageError)
    assert "quad got its moves on demand at tick 0" in str(refused.exception)
    assert not (tmp_path / "bundle.zip").exists()
    assert json.loads((tmp_path / "trace.jsonl").read_text().splitlines()[1])["verified"] == "moves"
