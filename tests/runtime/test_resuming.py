"""Runs that are cut off anywhere continue from what their traces say."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path

import pytest

from safenav.audit.check import check_trace
from safenav.errors import UsageError
from safenav.outcome import Outcome
from safenav.runtime.mission import Mission
from safenav.runtime.resuming import resumed
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.reading import read_trace
from safenav.trace.writing import TraceWriter

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SAFENAV = Path(sys.executable).parent / "safenav"


def written(scenario: Scenario, path: Path) -> Outcome:
    with TraceWriter(path) as trace:
        return Mission(scenario, listeners=[trace]).run().outcome


@pytest.mark.parametrize("clock", ["live", "lockstep"])
@pytest.mark.parametrize("name", ["case_study_3", "corridor_swap", "beam", "two_digits"])
def test_a_run_that_is_cut_off_continues(name: str, clock: str, tmp_path: Path) -> None:
    whole, cut, rest = (tmp_path / f"{part}.jsonl" for part in ("whole", "cut", "rest"))
    run = [SAFENAV, "run", SCENARIOS / f"{name}.yaml", "--clock", clock, "--trace", whole]
    subprocess.run(run, capture_output=True, check=False)
    lines = whole.read_text().splitlines(keepends=True)
    rng = random.Random(f"{name} {clock}")
    for end in rng.sample(range(1, len(lines) - 1), 2):
        cut.write_text("".join(lines[:end]) + '{"type":"mo')
        scenario = resumed(read_trace(cut))
        assert written(scenario, rest) is Outcome.COMPLETED
        audit = check_trace(rest)
        assert audit.findings == (), "\n".join(map(str, audit.findings))


def test_what_is_known_is_kept(tmp_path: Path) -> None:
    """After the door of case study 3 is open, robots begin where they are, without the door."""
    path = tmp_path / "trace.jsonl"
    original = load_scenario(SCENARIOS / "case_study_3.yaml")
    written(original, path)
    lines = path.read_text().splitlines(keepends=True)
    told = [json.loads(line) for line in lines]
    end = next(i for i, line in enumerate(told) if line["type"] == "resolved")
    path.write_text("".join(lines[: end + 1]))
    scenario = resumed(read_trace(path))
    assert [o.name for o in scenario.obstacles] == ["uncertainty@43"]
    for robot in scenario.robots:
        moves = [line for line in told[:end] if line["type"] == "move"]
        at = [line["to"] for line in moves if line["robot"] == robot.name][-1]
        assert robot.start.region == at


def test_a_finished_run_is_not_resumed(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    written(load_scenario(SCENARIOS / "hello.yaml"), path)
    with pytest.raises(UsageError, match="nothing to resume"):
        resumed(read_trace(path))
    done = subprocess.run([SAFENAV, "resume", path], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:9]))
    rest = tmp_path / "rest.jsonl"
    resume = [SAFENAV, "resume", path, "--trace", rest, "--no-map"]
    assert subprocess.run(resume, capture_output=True, check=False).returncode == 0
    assert json.loads(rest.read_text().splitlines()[-1])["outcome"] == "completed"
