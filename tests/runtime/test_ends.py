"""Ends of runs from outside: limits, signals, readers that close, conflicting files."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

import warm
from children import ran
from safenav.errors import Outcome, UsageError
from safenav.run.checked import check_trace
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario
from safenav.synthesis.slugs import Synthesizer
from synthesis.requests import gone

ROOT = Path(__file__).parents[2]
HELLO = ROOT / "scenarios" / "hello.yaml"
WAREHOUSE = ROOT / "scenarios" / "warehouse.yaml"


MAIN = "from safenav.cli import main; main()"
HEEDED = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"
"""A test run that is started by nohup ignores SIGHUP, and so would its programs."""
STUCK = """
import pathlib, time
from safenav.runtime.worlds.simulation import SimulatedWorld
SimulatedWorld.move = lambda *_: pathlib.Path({!r}).touch() or time.sleep(900)
"""
"""A world in which the first move never ends; it leaves a file."""
CHECKS = """
import os, pathlib, time
import safenav.certify.check
safenav.certify.check.check = lambda *_: (
    pathlib.Path({!r}).write_text(str(os.getpid())) and time.sleep(900)
)
"""
"""A check of a bundle that never ends; its process leaves its number."""
UNSURE = """
import time
import safenav.runtime.run.mission
safenav.runtime.run.mission.first_failure = lambda *_: time.sleep(900)
"""
"""A verification that never ends."""

AT_ONCE = """
import os, signal, threading
called = "_start_joinable_thread"
called = called if hasattr(threading, called) else "_start_new_thread"  # before Python 3.13
start = getattr(threading, called)
def pressed(*given, **named):
    number = start(*given, **named)
    if getattr(given[0], "__self__", None).name == "synthesis":
        given[0].__self__._started.wait()
        os.kill(os.getpid(), signal.SIGINT)
        sum(range(100))
    return number
setattr(threading, called, pressed)
"""
"""Ctrl-C while the thread of a synthesis is started."""


PRESSED = """
import sys
class Finder:
    def find_spec(name, *_):
        if name == "click":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Finder)
"""
"""Ctrl-C while the command is imported."""


def safenav(*arguments: object, before: str = "", **variables: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", HEEDED + before + MAIN, *map(str, arguments)]
    environment = {**os.environ, "SAFENAV_CACHE": "off", **variables}
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


@pytest.mark.parametrize(
    ("scenario", "before"), [(WAREHOUSE, ""), (HELLO, UNSURE)], ids=["run", "verification"]
)
def test_a_run_keeps_its_time_limit(scenario: Path, before: str, tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    arguments = ("run", scenario, "--no-map", "--time-limit", "0.05", "--trace", trace)
    run = safenav(*arguments, before=before)
    run.communicate(timeout=300)
    assert (run.returncode, outcome(trace)) == (3, "time_limit")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_run_with_its_outcome(number: signal.Signals, tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    run = safenav("run", WAREHOUSE, "--no-map", "--trace", trace)
    while not trace.exists() or not trace.read_text():
        time.sleep(0.05)
    run.send_signal(number)
    said = run.communicate(timeout=300)[1]
    assert run.returncode == 130
    assert outcome(trace) == "interrupted"
    assert "not as expected" not in said and "not compared with 'expect'" in said


def test_a_signal_inside_a_library_call_ends_the_run_cleanly(tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    run = safenav("run", HELLO, "--no-map", "--trace", trace, before=AT_ONCE)
    run.communicate(timeout=300)
    assert (run.returncode, outcome(trace)) == (130, "interrupted")


def test_a_run_that_is_interrupted_is_not_certified(tmp_path: Path) -> None:
    moved, bundle = tmp_path / "moved", tmp_path / "bundle"
    run = safenav("certify", HELLO, "-o", bundle, before=STUCK.format(str(moved)))
    while not moved.exists():
        time.sleep(0.05)
    run.send_signal(signal.SIGTERM)
    said = run.communicate(timeout=300)[1]
    assert (run.returncode, said.strip()) == (130, "error: interrupted")
    assert list(tmp_path.iterdir()) == [moved]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_the_checker_process_of_a_bundle_ends_with_its_parent(
    number: signal.Signals, tmp_path: Path
) -> None:
    checks = tmp_path / "pid"
    run = safenav("certify", HELLO, "-o", tmp_path / "bundle", before=CHECKS.format(str(checks)))
    while not (checks.exists() and checks.read_text()):
        time.sleep(0.05)
    run.send_signal(number)
    run.communicate(timeout=300)
    assert gone(int(checks.read_text()))
    if number is signal.SIGTERM:
        assert (run.returncode, list(tmp_path.iterdir())) == (130, [checks])


def test_ctrl_c_during_the_imports_prints_no_traceback() -> None:
    program = f"{PRESSED}import runpy; runpy.run_module('safenav', run_name='__main__')"
    done = ran([sys.executable, "-c", program])
    assert (done.returncode, done.stderr) == (130, "error: interrupted\n")


def test_threads_and_actions_at_exit_end_before_the_command() -> None:
    program = """
import atexit, sys, threading
from safenav import __main__, cli
def ends():
    atexit.register(print, "action", end="")
    threading.Timer(0.1, print, ["thread"]).start()
    sys.exit(3)
cli.main = ends
__main__.main()
"""
    buffered = {key: text for key, text in os.environ.items() if key != "PYTHONUNBUFFERED"}
    command = [sys.executable, "-c", program]
    done = ran(command, env=buffered)
    assert (done.returncode, done.stdout, done.stderr) == (3, "thread\naction", "")


def test_a_closed_standard_output_does_not_change_the_outcome(tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    run = safenav("run", HELLO, "--no-map", "--trace", trace)
    assert run.stdout is not None
    run.stdout.readline()
    run.stdout.close()
    assert run.stderr is not None
    with run.stderr:
        assert run.wait(timeout=300) == 0
        assert run.stderr.read() == ""
    assert outcome(trace) == "completed"


def test_a_trace_on_standard_output_stands_there_alone(tmp_path: Path) -> None:
    done = warm.safenav("run", HELLO, "--trace", "-", cwd=tmp_path)
    assert not check_trace(done.stdout.splitlines()).findings
    assert "completed" in done.stderr and not [*tmp_path.iterdir()]


@pytest.mark.parametrize("times", [1, 2])
def test_signals_end_a_run_whose_world_hangs(times: int, tmp_path: Path) -> None:
    trace, moving = tmp_path / "t.jsonl", tmp_path / "moving"
    before = STUCK.format(str(moving))
    with safenav("run", HELLO, "--no-map", "--trace", trace, before=before) as run:
        while not moving.exists():
            assert run.poll() is None
            time.sleep(0.05)
        for _ in range(times):
            run.send_signal(signal.SIGINT)
            time.sleep(0.1)
        _, error = run.communicate(timeout=300)
    assert run.returncode == 130
    assert "Traceback" not in error
    assert outcome(trace) == "interrupted"


def test_no_synthesizer_outlives_a_killed_run(tmp_path: Path) -> None:
    slugs, pids = tmp_path / "slugs", tmp_path / "pids"
    slugs.write_text(
        '#!/bin/sh\n[ "$1" = --version ] && { echo "slugs 9.9.9 (safenav)"; exit; }\n'
        f'echo $$ >> "{pids}"; exec sleep 900\n'
    )
    slugs.chmod(0o755)
    run = safenav("run", HELLO, "--no-map", SAFENAV_SLUGS=str(slugs))
    while not pids.exists() or not pids.read_text().strip():
        assert run.poll() is None, run.communicate()
        time.sleep(0.05)
    run.kill()
    run.communicate(timeout=300)
    assert all(gone(int(pid)) for pid in pids.read_text().split())


def test_a_mission_refuses_calls_out_of_order() -> None:
    with pytest.raises(UsageError, match=r"'hello\.yaml' is not a Scenario"):
        Mission("hello.yaml")  # type: ignore[arg-type]
    mission = Mission(load_scenario(HELLO))
    with pytest.raises(UsageError, match="before start"):
        mission.step()
    assert mission.run().outcome is Outcome.COMPLETED
    with pytest.raises(UsageError, match="after the end"):
        mission.step()
    with pytest.raises(UsageError, match="second time"):
        mission.run()


def test_another_thread_stops_a_run_within_a_synthesis(monkeypatch: pytest.MonkeyPatch) -> None:
    """No exception is raised in that thread: it is not the run's."""
    usual, ended = Synthesizer.synthesize_all, list[bool]()

    def stop() -> None:
        mission.stop("enough")
        ended.append(True)

    def stopped(*given: Any, **options: Any) -> Any:
        other = threading.Thread(target=stop)
        other.start()
        other.join()
        return usual(*given, **options)

    monkeypatch.setattr(Synthesizer, "synthesize_all", stopped)
    mission = Mission(load_scenario(HELLO))
    result = mission.run()
    assert ended and (result.outcome, result.ticks) == (Outcome.INTERRUPTED, 0)
    assert result.explanation == "enough"
