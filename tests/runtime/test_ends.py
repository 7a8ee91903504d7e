"""How runs end from outside: limits, signals, readers that go away, files in each other's way."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from safenav.errors import UsageError
from safenav.runtime.mission import Mission
from safenav.scenario.model import Outcome
from safenav.scenario.reading.loader import load_scenario

ROOT = Path(__file__).parents[2]
HELLO = ROOT / "scenarios" / "hello.yaml"
WAREHOUSE = ROOT / "scenarios" / "warehouse.yaml"


def safenav(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", "from safenav.cli import main; main()"]
    command += map(str, arguments)
    environment = {**os.environ, "SAFENAV_CACHE": "off"}
    return subprocess.Popen(
        command,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def outcome(trace: Path) -> str:
    last = json.loads(trace.read_text().splitlines()[-1])
    assert last["type"] == "outcome"
    return str(last["outcome"])


def test_a_run_keeps_its_time_limit(tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    run = safenav("run", WAREHOUSE, "--no-map", "--time-limit", "0.5", "--trace", trace)
    run.communicate(timeout=60)
    assert run.returncode == 3
    assert outcome(trace) == "time_limit"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_run_with_its_outcome(number: signal.Signals, tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    run = safenav("run", WAREHOUSE, "--no-map", "--trace", trace)
    while not trace.exists() or not trace.read_text():
        time.sleep(0.05)
    run.send_signal(number)
    run.communicate(timeout=60)
    assert run.returncode == 130
    assert outcome(trace) == "interrupted"


def test_the_outcome_does_not_depend_on_who_reads_the_story(tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    run = safenav("run", HELLO, "--no-map", "--trace", trace)
    assert run.stdout is not None
    run.stdout.readline()
    run.stdout.close()
    assert run.stderr is not None
    with run.stderr:
        assert run.wait(timeout=60) == 0
    assert outcome(trace) == "completed"


@pytest.mark.parametrize("option", ["--trace", "--html"])
def test_outputs_never_overwrite_the_scenario(option: str, tmp_path: Path) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(HELLO.read_text())
    run = safenav("run", file, option, file)
    _, error = run.communicate(timeout=60)
    assert run.returncode == 2
    assert "overwrite" in error
    assert file.read_text() == HELLO.read_text()


def test_a_mission_is_stepped_in_its_order() -> None:
    mission = Mission(load_scenario(HELLO))
    with pytest.raises(UsageError, match="before start"):
        mission.step()
    assert mission.run().outcome is Outcome.COMPLETED
    with pytest.raises(UsageError, match="after the end"):
        mission.step()
    with pytest.raises(UsageError, match="second time"):
        mission.run()
