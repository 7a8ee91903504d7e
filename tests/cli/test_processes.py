"""The command as a process: its streams, its interruption, and the files that it writes."""

import json
import os
import pty
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from children import ran
from once import SCENARIOS

HELLO = SCENARIOS / "hello.yaml"
CATALOGUE = ("new", "--catalogue")


def program(*words: object, before: str = "") -> list[str]:
    """A new process of safenav, which begins with a statement."""
    main = f"{before}\nfrom safenav.cli import main; main()"
    return [sys.executable, "-c", f"import sys; sys.argv[0] = 'safenav'{main}", *map(str, words)]


def run(*words: object, before: str = "", **options: Any) -> subprocess.CompletedProcess[str]:
    return ran(program(*words, before=before), **options)


def test_an_unwritable_cache_gives_one_warning_without_source_code(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    cache = {"SAFENAV_CACHE": str(tmp_path / "file" / "cache"), "NO_COLOR": "1"}
    done = run("check", SCENARIOS / "case_study_1.yaml", env={**os.environ, **cache})
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warning: ") and done.stderr.count("warning: ") == 1
    assert "SAFENAV_CACHE" in done.stderr
    assert "warnings.warn" not in done.stderr and ".py" not in done.stderr


def test_a_full_disk_is_not_reported_as_a_defect_of_safenav() -> None:
    """The exit code stays the same, although some output is still buffered at the exit."""
    with Path("/dev/full").open("w") as full:
        done = run(*CATALOGUE, capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 2
    assert "cannot write the output: No space left on device" in done.stderr


@pytest.mark.parametrize(("name", "code"), [("hello", 0), ("unrealizable/forbidden_way", 1)])
def test_a_closed_pipe_changes_no_exit_code(name: str, code: int) -> None:
    """It does not become 1, the code of an unrealizable robot."""
    piped = '"$@" | true; exit ${PIPESTATUS[0]}'
    done = ran(["bash", "-c", piped, "-", *program("check", SCENARIOS / f"{name}.yaml")])
    assert (done.returncode, done.stderr) == (code, "")


def test_a_pipe_is_an_input_that_is_read_once() -> None:
    """Recognizing a specification must not empty it."""
    done = ran(["bash", "-c", '"$@" <(printf "[OUTPUT]\\nb\\n")', "-", *program("explain")])
    assert "is realizable: nothing to explain" in done.stdout, done.stderr


USES_STREAMS = """; import atexit, os
atexit.register(lambda: os.system(": 3<&0 4>&1 5>&2") and os._exit(9))"""


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_run_needs_no_open_standard_stream(closed: str, tmp_path: Path) -> None:
    """A service has none. The trace must not go to the files that replace them, which programs
    that safenav starts have, too."""
    trace = tmp_path / "t.jsonl"
    command = program("run", HELLO, "--trace", trace, before=USES_STREAMS)
    done = ran(["sh", "-c", f'exec "$@" {closed}', "-", *command])
    assert (done.returncode, done.stderr) == (0, "")
    assert bool(done.stdout) == (closed == "2>&-")
    assert [json.loads(line)["type"] for line in trace.read_text().splitlines()][-1] == "outcome"


PAUSE = """; import os, signal; from safenav.studio import server
server.time.sleep = lambda _: (signal.raise_signal(signal.SIGINT), os._exit(9))"""


def test_an_interruption_ends_the_wait_for_the_page_of_an_ended_drive(tmp_path: Path) -> None:
    """It comes in the first pause of the wait; no second one is needed."""
    (tmp_path / "fleet").write_text("safenav-fleet: 1\ntransport: ros2\n")
    words = "drive", HELLO, "--fleet", tmp_path / "fleet", "--rehearse", "--live"
    done = run(*words, before=PAUSE, env={**os.environ, "BROWSER": "true"})
    assert done.returncode == 0 and "completed" in done.stdout


def test_closing_the_terminal_interrupts_the_program() -> None:
    controller, terminal = pty.openpty()
    command = program(*CATALOGUE, before="; input()")
    asked = subprocess.PIPE
    with subprocess.Popen(command, stdin=asked, stdout=terminal, stderr=terminal) as process:
        os.close(terminal)
        os.close(controller)
        process.communicate(b"\n", timeout=300)
    assert process.returncode == 130


FAILING = """
import sys, safenav.cli.options, safenav.errors
def failing(*_, **__):
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as interruption:
        raise {}
safenav.cli.options.group.main = failing"""
AT_START = """
import signal, sys, safenav.cli.options
def interrupted(*_, **__):
    raise KeyboardInterrupt
{} = interrupted"""

INTERRUPTIONS = {
    "before signals are handled": AT_START.format("signal.getsignal"),
    "in the command": AT_START.format("safenav.cli.options.group.main"),
    "before streams are open": AT_START.format("safenav.cli._open_closed_streams"),
    "a defect after it": FAILING.format("ValueError('half a step')"),
    "a defect from it": FAILING.format("ValueError('half a step') from interruption"),
    "an error after it": FAILING.format("safenav.errors.SynthesizerError('half')"),
    "an error from it": FAILING.format("safenav.errors.SynthesizerError('half') from interruption"),
}


@pytest.mark.parametrize("before", INTERRUPTIONS.values(), ids=INTERRUPTIONS.keys())
def test_an_interruption_is_reported_even_at_the_start_or_when_a_step_fails(before: str) -> None:
    done = run(*CATALOGUE, before=before)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


@pytest.mark.parametrize("wanted", [True, False])
def test_colours_are_for_terminals_and_can_be_switched_off(wanted: bool, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("safenav: 2\n")
    environment = {**os.environ, "NO_COLOR": "" if wanted else "1", "TERM": "xterm"}
    for scenario, told in ((HELLO, "realizable"), (tmp_path / "s.yaml", "error")):
        near, far = pty.openpty()
        run("check", scenario, capture_output=False, stdout=far, stderr=far, env=environment)
        os.close(far)
        said = os.read(near, 10_000).decode()
        os.close(near)
        assert told in said
        assert ("\x1b[" in said) == wanted


def test_the_progress_of_a_gif_fits_a_narrow_terminal(tmp_path: Path) -> None:
    trace = tmp_path / "t.jsonl"
    assert run("run", HELLO, "--trace", trace).returncode == 0
    near, far = pty.openpty()
    film = ("replay", trace, "-o", tmp_path / "t.gif", "--speed", "100")
    run(*film, capture_output=False, stdout=far, stderr=far, env={**os.environ, "COLUMNS": "30"})
    os.close(far)
    said = re.sub(r"\x1b\[[?\d]*\w", "", os.read(near, 10_000).decode())
    os.close(near)
    shown = [line for line in said.split("\r") if line.startswith("drawing")]
    assert "100%" in shown[-1] and max(map(len, shown)) <= 30
