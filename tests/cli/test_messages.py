"""What a mistake looks like, and a broken tool: a clear message, the right exit code."""

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

import warm
from children import ran
from cli.conftest import MAIN, Command
from once import SCENARIOS
from support.damage import GOOD as TRACES
from support.damage import text

GOOD = """\
safenav: 1
map:
  grid: |
    #####
    #...#
    #####
robots:
  quad: {model: quadcopter, start: 6, objective: {patrol: [6, 8]}}
"""


@pytest.mark.parametrize("command", ["run", "new --catalogue"])
def test_scenarios_are_read_from_standard_input(command: str, tmp_path: Path) -> None:
    done = warm.safenav(*command.split(), "-", cwd=tmp_path, text=GOOD)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_a_trace_is_read_from_standard_input() -> None:
    lines = text(TRACES["nested"]())
    done = warm.safenav("check", "-", text="\n".join(lines) + "\n")
    assert done.returncode == 0 and "<stdin>" in done.stdout


STUCK = """\
safenav: 1
map: {grid: ['#######', '#.....#', '#######']}
robots: {flyer: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}}
obstacles: [{type: door, region: 10}]
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    ("typed", "prompts", "code"),
    [("nonsense\nresolved door@10\n\n", 3, 0), ("", 1, 1), ("\nresolved door@10", 3, 0)],
    ids=["resolves it", "types nothing", "a last line without an end"],
)
def test_an_operator_is_prompted_until_an_empty_line_or_the_end_of_the_input(
    typed: str, prompts: int, code: int, tmp_path: Path
) -> None:
    (tmp_path / "s.yaml").write_text(STUCK)
    prompted = ("run", "s.yaml", "--clock", "live", "--operator")
    done = warm.safenav(*prompted, cwd=tmp_path, text=typed)
    assert done.stderr.count("operator> ") == prompts, done.stderr[:2000]
    assert ("nonsense" in done.stderr) == ("nonsense" in typed)
    assert done.returncode == code, done.stdout


def test_a_cache_that_cannot_be_written_is_reported_without_code(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(GOOD)
    (tmp_path / "file").write_text("in the way")
    script = f"import sys; sys.argv = ['safenav', 'check', 's.yaml']; {MAIN}"
    done = ran(
        [sys.executable, "-c", script],
        env={**os.environ, "SAFENAV_CACHE": str(tmp_path / "file" / "cache"), "NO_COLOR": "1"},
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warning: ")
    assert "warnings.warn" not in done.stderr and ".py" not in done.stderr


def test_an_output_on_a_full_disk_is_not_a_defect() -> None:
    script = f"import sys; sys.argv = ['safenav', 'new', '--catalogue']; {MAIN}"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", script],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=300,
            check=False,
        )
    assert done.returncode == 2
    assert "cannot write the output: No space left on device" in done.stderr


@pytest.mark.parametrize(("name", "code"), [("hello", 0), ("unrealizable/forbidden_way", 1)])
def test_a_closed_pipe_changes_no_exit_code(name: str, code: int) -> None:
    """It always was 1, which says that a robot is unrealizable."""
    script = f"import sys; sys.argv = ['safenav', 'check', '{SCENARIOS / name}.yaml']; {MAIN}"
    piped = '"$0" -c "$1" | true; exit ${PIPESTATUS[0]}'
    done = subprocess.run(
        ["bash", "-c", piped, sys.executable, script], capture_output=True, timeout=300, check=False
    )
    assert (done.returncode, done.stderr) == (code, b"")


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_standard_streams_may_be_closed(closed: str, tmp_path: Path) -> None:
    """As for a service. The trace is not what is written to them."""
    trace = tmp_path / "t.jsonl"
    script = f"import sys; sys.argv[0] = 'safenav'; {MAIN}"
    command = [sys.executable, "-c", script, "run", SCENARIOS / "hello.yaml", "--trace", trace]
    shell = ["sh", "-c", f'exec "$0" "$@" {closed}', *map(str, command)]
    done = ran(shell)
    assert (done.returncode, done.stderr) == (0, "")
    assert bool(done.stdout) == (closed == "2>&-")
    assert [json.loads(line)["type"] for line in trace.read_text().splitlines()][-1] == "outcome"


def test_a_terminal_that_is_closed_ends_the_program_as_interrupted() -> None:
    controller, terminal = pty.openpty()
    script = f"import sys; sys.argv = ['safenav', 'new', '--catalogue']; input(); {MAIN}"
    command = [sys.executable, "-c", script]
    asked = subprocess.PIPE
    with subprocess.Popen(command, stdin=asked, stdout=terminal, stderr=terminal) as program:
        os.close(terminal)
        os.close(controller)
        program.communicate(b"\n", timeout=300)
    assert program.returncode == 130


@pytest.mark.parametrize(
    "where", ["signal.getsignal", "safenav.cli.group.main", "safenav.cli._open_closed_streams"]
)
def test_an_interruption_at_the_very_start_is_told_like_any_other(where: str) -> None:
    place, _, name = where.rpartition(".")
    script = f"""\
import signal, sys, safenav.cli
def interrupted(*_, **__):
    raise KeyboardInterrupt
{place}.{name} = interrupted
sys.argv = ['safenav', 'new', '--catalogue']
{MAIN}"""
    done = ran([sys.executable, "-c", script])
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


@pytest.mark.parametrize("error", ["ValueError", "safenav.errors.SynthesizerError"])
@pytest.mark.parametrize("cause", ["", " from interruption"])
def test_what_fails_after_an_interruption_is_told_as_interrupted(error: str, cause: str) -> None:
    script = f"""\
import sys, safenav.cli, safenav.errors
def failing(*_, **__):
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as interruption:
        raise {error}('half a step'){cause}
safenav.cli.group.main = failing
{MAIN}"""
    done = ran([sys.executable, "-c", script])
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


@pytest.mark.parametrize("wanted", [True, False])
def test_colours_are_for_terminals_and_can_be_switched_off(wanted: bool, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("safenav: 2\n")
    environment = {**os.environ, "NO_COLOR": "" if wanted else "1", "TERM": "xterm"}
    for scenario, told in (
        (SCENARIOS / "hello.yaml", "realizable"),
        (tmp_path / "s.yaml", "error"),
    ):
        near, far = pty.openpty()
        command = [sys.executable, "-c", MAIN, "check", str(scenario)]
        subprocess.run(command, stdout=far, stderr=far, env=environment, check=False)
        os.close(far)
        said = os.read(near, 10_000).decode()
        os.close(near)
        assert told in said
        assert ("\x1b[" in said) == wanted


HELLO = SCENARIOS / "hello.yaml"


def fake(tmp_path: Path, script: str) -> Path:
    binary = tmp_path / "fake slugs"
    binary.write_text(f"#!/bin/bash\ncat > /dev/null\n{script}\n")
    binary.chmod(0o755)
    return binary


def test_a_name_that_no_file_can_have_is_bad_input(safenav: Command) -> None:
    done = safenav("batch", HELLO, "-o", "n" * 5000)
    assert (done.returncode, done.stdout) == (2, "") and "Traceback" not in done.stderr


@pytest.mark.slow
def test_synthesizer_that_hangs_is_a_resource_limit(safenav: Command, tmp_path: Path) -> None:
    slow = tmp_path / "slow.yaml"
    slow.write_text(
        HELLO.read_text().replace("{ticks: 100}", "{ticks: 100, synthesis_seconds: 0.3}")
    )
    done = safenav("run", slow, SAFENAV_SLUGS=str(fake(tmp_path, "sleep 60")))
    assert done.returncode == 3
    assert "timeout" in done.stderr
    assert "synthesis_seconds" in done.stderr
