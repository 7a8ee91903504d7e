"""Ends of commands from outside: limits, signals at chosen and at random moments, readers that
close. A command ends with 130 or has finished; it prints nothing that it would not have printed,
writes no half file, and leaves no process."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import pytest

import warm
from children import gone, ran
from once import SCENARIOS, beside, from_yaml, made_once
from safenav import Mission, Outcome, Synthesizer, check_trace, load_scenario
from slugs.conftest import ENDLESS

HELLO, WAREHOUSE = SCENARIOS / "hello.yaml", SCENARIOS / "warehouse.yaml"
INTERRUPTED = 130
PATIENCE = 300
"""Seconds; a command that swallows the signal takes longer, or ends with another status."""
ENVIRONMENT = {**os.environ, "SAFENAV_CACHE": "off", "NO_COLOR": "1", "COLUMNS": "200"}
START = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL)\n{}\n" + (
    "from safenav.cli import main; main()"
)
"""A test run that is started by nohup ignores SIGHUP, and so would its programs."""

STUCK = """
import pathlib, time
from safenav import SimulatedWorld
SimulatedWorld.move = lambda *_: pathlib.Path({!r}).write_text("moves") and time.sleep(900)
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
DRAWS = """
import os, pathlib, signal, time
def svg_to_bytes(**_):
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    pathlib.Path({!r}).write_text(str(os.getpid()))
    time.sleep(900)
"""
"""A library that never returns to Python while it draws."""
TRIES = """
import contextlib, pathlib, sys; from signal import *; from safenav.files import try_out
for number in range(200):
    now = iter([*[False] * number, True])
    with contextlib.suppress(KeyboardInterrupt):
        sys.setprofile(lambda _, e, __: e != "return" and next(now, False) and raise_signal(SIGINT))
        try_out(pathlib.Path("new")); sys.setprofile(None)
    assert not [*pathlib.Path().iterdir()], number
"""
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
BETWEEN = """
from safenav import Mission
step = Mission.step
def pressed(mission):
    step(mission)
    raise KeyboardInterrupt
Mission.step = pressed
"""
"""Ctrl-C between two ticks."""
PRESSED = """
import sys
class Presses:
    def __set_name__(*_):
        raise KeyboardInterrupt
class Finder:
    def find_spec(name, *_):
        if name == "click":
            {}
sys.meta_path.insert(0, Finder)
import runpy; runpy.run_module('safenav', run_name='__main__')
"""
"""Ctrl-C while the command is imported; a class that is being made wraps it in an error."""
AT_EXIT = """
import atexit, sys, threading
from safenav import __main__, cli
def ends():
    atexit.register(print, "action", end="")
    threading.Timer(0.1, print, ["thread"]).start()
    sys.exit(3)
cli.main = ends
__main__.main()
"""


def started(*words: object, **options: Any) -> subprocess.Popen[str]:
    """A Python program that runs."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    command = [sys.executable, *map(str, words)]
    return subprocess.Popen(command, **{"env": ENVIRONMENT} | pipes | options)  # type: ignore[call-overload, no-any-return]


def ended(
    *arguments: object,
    before: str = "",
    ready: Path | None = None,
    signals: Sequence[int] = (),
    **variables: str,
) -> tuple[int, str]:
    """The status and the messages of a command that receives signals once a file is not empty."""
    words, env = ("-c", START.format(before), *arguments), {**ENVIRONMENT, **variables}
    with started(*words, env=env) as run:
        while ready is not None and not (ready.exists() and ready.read_text()):
            assert run.poll() is None, run.communicate()
            time.sleep(0.05)
        for number in signals:
            run.send_signal(number)
            time.sleep(0.1)
        said = run.communicate(timeout=PATIENCE)[1]
    assert "Traceback" not in said
    return run.returncode, said


def outcome(trace: Path) -> str:
    last = json.loads(trace.read_text().splitlines()[-1])
    assert last["type"] == "outcome"
    return str(last["outcome"])


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    return tmp_path / "t.jsonl"


@pytest.mark.parametrize(
    ("scenario", "before"), [(WAREHOUSE, ""), (HELLO, UNSURE)], ids=["run", "verification"]
)
def test_a_run_ends_at_its_time_limit(scenario: Path, before: str, trace: Path) -> None:
    words = ("run", scenario, "--no-map", "--time-limit", "0.05", "--trace", trace)
    assert ended(*words, before=before)[0] == 3
    assert outcome(trace) == "time_limit"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_run_as_interrupted(number: int, trace: Path) -> None:
    words = ("run", WAREHOUSE, "--no-map", "--trace", trace)
    status, said = ended(*words, ready=trace, signals=[number])
    assert (status, outcome(trace)) == (INTERRUPTED, "interrupted")
    assert "not as expected" not in said and "'expect' is not checked" in said


@pytest.mark.parametrize("before", [AT_ONCE, BETWEEN])
@pytest.mark.parametrize("more", [(), ("--clock", "live", "--operator")])
def test_signals_at_any_time_end_runs_cleanly(
    before: str, more: Sequence[str], trace: Path
) -> None:
    status, _ = ended("run", HELLO, "--no-map", *more, "--trace", trace, before=before)
    assert (status, outcome(trace)) == (INTERRUPTED, "interrupted")


@pytest.mark.parametrize("times", [1, 2])
def test_signals_end_a_run_whose_world_hangs(times: int, trace: Path) -> None:
    moves, words = trace.with_name("moves"), ("run", HELLO, "--no-map", "--trace", trace)
    signals = [signal.SIGINT] * times
    status, _ = ended(*words, before=STUCK.format(str(moves)), ready=moves, signals=signals)
    assert (status, outcome(trace)) == (INTERRUPTED, "interrupted")


def test_a_run_that_is_interrupted_is_not_certified(tmp_path: Path) -> None:
    moves, words = tmp_path / "moves", ("certify", HELLO, "-o", tmp_path / "bundle")
    before = STUCK.format(str(moves))
    status, said = ended(*words, before=before, ready=moves, signals=[signal.SIGTERM])
    assert (status, said.strip()) == (INTERRUPTED, "error: interrupted")
    assert list(tmp_path.iterdir()) == [moves]


def test_a_large_picture_can_be_interrupted(tmp_path: Path) -> None:
    draws, words = tmp_path / "pid", ("draw", HELLO, "-o", tmp_path / "p.png", "--width", 2000)
    (tmp_path / "resvg_py.py").write_text(DRAWS.format(str(draws)))
    path = {"PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    status, said = ended(*words, ready=draws, signals=[signal.SIGINT], **path)
    assert (status, said.strip()) == (INTERRUPTED, "error: interrupted")
    assert gone(int(draws.read_text())) and not (tmp_path / "p.png").exists()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_the_checker_process_of_a_bundle_ends_with_its_parent(number: int, tmp_path: Path) -> None:
    checks, words = tmp_path / "pid", ("certify", HELLO, "-o", tmp_path / "bundle")
    status, _ = ended(*words, before=CHECKS.format(str(checks)), ready=checks, signals=[number])
    assert gone(int(checks.read_text()))
    if number is signal.SIGTERM:
        assert (status, list(tmp_path.iterdir())) == (INTERRUPTED, [checks])


def test_no_synthesizer_outlives_a_killed_run(tmp_path: Path) -> None:
    slugs, pids = tmp_path / "slugs", tmp_path / "pids"
    (endless := tmp_path / "endless").write_text(ENDLESS)
    slugs.write_text(f'#!/bin/sh\necho $$ >> "{pids}"\nexec "{Synthesizer().binary}" "{endless}"\n')
    slugs.chmod(0o755)
    words, killed = ("run", HELLO, "--no-map"), [signal.SIGKILL]
    ended(*words, ready=pids, signals=killed, SAFENAV_SLUGS=str(slugs))
    assert all(gone(int(pid)) for pid in pids.read_text().split())


@pytest.mark.parametrize(
    ("program", "end"),
    [
        (PRESSED.format("raise KeyboardInterrupt"), (130, "", "error: interrupted\n")),
        (PRESSED.format("type('', (), dict(a=Presses()))"), (130, "", "error: interrupted\n")),
        (AT_EXIT, (3, "thread\naction", "")),
    ],
    ids=[
        "Ctrl-C during the imports prints no traceback",
        "Ctrl-C while a class is made prints no traceback",
        "threads and exit handlers run to their end",
    ],
)
def test_an_interrupted_start_and_an_exit_with_threads_are_clean(
    program: str, end: tuple[int, str, str]
) -> None:
    buffered = {key: text for key, text in os.environ.items() if key != "PYTHONUNBUFFERED"}
    done = ran([sys.executable, "-c", program], env=buffered)
    assert (done.returncode, done.stdout, done.stderr) == end


def test_a_closed_standard_output_does_not_change_the_outcome(trace: Path) -> None:
    run = started("-m", "safenav", "run", HELLO, "--no-map", "--trace", trace)
    assert run.stdout is not None and run.stderr is not None
    run.stdout.readline()
    run.stdout.close()
    with run.stderr:
        assert run.wait(timeout=PATIENCE) == 0
        assert run.stderr.read() == ""
    assert outcome(trace) == "completed"


def test_a_trace_on_standard_output_is_the_only_text_there(tmp_path: Path) -> None:
    done = warm.safenav("run", HELLO, "--trace", "-", cwd=tmp_path)
    assert "\n\n" not in done.stdout and not check_trace(done.stdout.splitlines()).findings
    assert "completed" in done.stderr and not [*tmp_path.iterdir()]


def test_another_thread_stops_a_run_within_a_synthesis(monkeypatch: pytest.MonkeyPatch) -> None:
    """No exception is raised in that thread: it is not the run's."""
    usual, stops = Synthesizer.synthesize_all, list[bool]()

    def stop() -> None:
        mission.stop("enough")
        stops.append(True)

    def stopped(*given: Any, **options: Any) -> Any:
        other = threading.Thread(target=stop)
        other.start()
        other.join()
        return usual(*given, **options)

    monkeypatch.setattr(Synthesizer, "synthesize_all", stopped)
    mission = Mission(load_scenario(HELLO))
    result = mission.run()
    assert stops and (result.outcome, result.ticks) == (Outcome.INTERRUPTED, 0)
    assert result.explanation == "enough"


# Each command at a random moment.

COMMANDS: dict[str, str] = from_yaml(beside(__file__, "commands.yaml"))
COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or len(COMMANDS)
INPUTS = {
    "s.yaml": SCENARIOS / "case_study_1.yaml",
    "big.yaml": SCENARIOS / "team_of_six.yaml",
    "batteries.yaml": SCENARIOS / "battery_delivery.yaml",
    "three_carts.yaml": Path(__file__).with_name("three_carts.yaml"),
    "circle.yaml": Path(__file__).with_name("circle.yaml"),
    "unrealizable.yaml": SCENARIOS / "unrealizable" / "dead_end.yaml",
    **{f"suite/{n}.yaml": SCENARIOS / f"case_study_{n}.yaml" for n in (1, 2, 3)},
}
_MEASURED = re.compile(r"\d[\d.,]* ?(?:ms|s|KiB|MB)\b|\d+\.\d\d$")
_AT_THE_END = re.compile(r"interrupted|--resume|(?:ticks?|the run), \d+ synthes|█|_decimal")
"""An interrupted run says so, with what it has done so far and where the robots are. (Python itself
warns if its module of decimals is interrupted while it loads.)"""


@pytest.fixture(scope="module")
def inputs() -> Path:
    """A folder with the inputs of all commands."""
    return made_once("inputs of all commands", _prepare)


def _prepare(folder: Path) -> None:
    (folder / "suite").mkdir()
    for name, source in INPUTS.items():
        shutil.copyfile(source, folder / name)
    for command in (
        "run s.yaml --trace t.jsonl",
        "export t.jsonl --motion m.jsonl",
        "synth s.yaml -o .",
        "certify s.yaml -o bundle",
    ):
        done = warm.safenav(*command.split(), cwd=folder, env=ENVIRONMENT)
        assert done.returncode == 0, done.stderr
    lines = (folder / "t.jsonl").read_text().splitlines(keepends=True)
    (folder / "cut.jsonl").write_text("".join(lines[: len(lines) // 2]))


class Finished(NamedTuple):
    """A command that ran to its end: its seconds after its start, status, lines, and files then."""

    seconds: float
    status: int
    lines: set[str]
    files: set[str]


def running(group: int) -> list[str]:
    """The running processes of a group: not those that are dead, until init takes note of it."""
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, of, *_ = file.read_text().rpartition(") ")[2].split()
            if int(of) == group and state != "Z":
                found.append(file.with_name("cmdline").read_text().replace("\0", " "))
    return found


def handles_signals(pid: int) -> bool:
    """Whether SIGTERM is handled, by the first statement of safenav. Before that Python itself
    begins, and an interrupt shows one of its tracebacks."""
    with suppress(OSError):
        status = Path(f"/proc/{pid}/status").read_text()
        caught = int(re.search(r"^SigCgt:\s*(\w+)$", status, re.MULTILINE)[1], 16)
        return bool(caught >> (signal.SIGTERM - 1) & 1)
    return False


def normal(text: str) -> list[str]:
    """The lines of an output, without measured times and sizes, which depend on them."""
    return [_MEASURED.sub("N", line.strip()) for line in text.splitlines() if line.strip()]


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def finished(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Finished]:
    @cache
    def of(command: str) -> Finished:
        folder = tmp_path_factory.mktemp("finished") / "inputs"
        shutil.copytree(inputs, folder)
        begun = time.monotonic()
        done = warm.safenav(*command.split(), cwd=folder, env=ENVIRONMENT)
        lines = {*normal(done.stdout + done.stderr)}
        return Finished(time.monotonic() - begun, done.returncode, lines, files(folder))

    return of


def test_an_interrupted_check_that_a_folder_is_writable_leaves_no_file(tmp_path: Path) -> None:
    child = started("-c", TRIES, cwd=tmp_path)
    assert (child.communicate()[1], child.returncode) == ("", 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(COUNT))
def test_an_interrupted_command_prints_nothing_false(
    seed: int, inputs: Path, finished: Callable[[str], Finished], tmp_path: Path
) -> None:
    random, command = Random(seed), [*COMMANDS.values()][seed % len(COMMANDS)]
    whole, folder = finished(command), tmp_path / "inputs"
    shutil.copytree(inputs, folder)
    before = files(folder)
    number = random.choice([signal.SIGINT, signal.SIGTERM])
    words = ("-m", "safenav", *command.split())
    child = started(*words, cwd=folder, start_new_session=True)
    while child.poll() is None and not handles_signals(child.pid):
        time.sleep(0.002)
    time.sleep(random.uniform(0, 0.3 + whole.seconds))  # with the imports
    sent = time.monotonic()
    child.send_signal(number)
    try:
        out, err = child.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        raise AssertionError(f"{command}: {number.name} was swallowed") from None
    print(f"{command}: {number.name}, {child.returncode} after {time.monotonic() - sent:.2f} s")
    assert running(child.pid) == [], "it has left processes behind"
    written = files(folder) - before
    if child.returncode == whole.status:
        assert written == whole.files - before
        return
    assert ", in main" not in err, "a traceback through safenav itself"
    assert child.returncode == INTERRUPTED, out + err
    strange = {line for line in normal(out + err) if not _AT_THE_END.search(line)} - whole.lines
    assert not strange, "every line of an interrupted command is one of the finished command's"
    for path in written:
        assert path in whole.files, f"{path} is left behind"
        check_whole(folder / path)


def check_whole(path: Path) -> None:
    """An output is complete, or a trace of complete lines that says how it ended."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".jsonl":
        lines = [json.loads(line) for line in text.splitlines()]
        assert text.endswith("\n")
        assert lines[-1].get("outcome", "interrupted") in ("interrupted", "completed")
    elif path.suffix == ".json":
        json.loads(text)
    elif path.suffix == ".html":
        assert text.rstrip().endswith("</html>")
    with suppress(UnicodeDecodeError):
        assert text, f"{path} is empty"
