"""What a mistake looks like: its line with a caret, the right kind of file, the right command."""

import json
import os
import pty
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

import warm
from children import ran
from cli.conftest import MAIN, Command
from once import SCENARIOS
from safenav.cli import COMMANDS

MAPS = Path(__file__).parents[1] / "maps"
ROOT = Path(__file__).parents[2]
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


def test_a_mistake_shows_its_line_and_a_caret(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(GOOD.replace("model:", "modle:"))
    found = safenav("check", "s.yaml")
    assert found.returncode == 2
    first, line, caret, hint = found.stderr.splitlines()[:4]
    assert first == "error: s.yaml:8:10: unknown key 'modle' in robot quad"
    assert line.strip().startswith("8 |   quad: {modle: quadcopter")
    assert line[caret.index("^") :].startswith("modle")
    assert "did you mean 'model'?" in hint


def test_a_mistake_in_a_type_brings_no_second_message(safenav: Command, tmp_path: Path) -> None:
    text = GOOD + (
        "catalogue: {obstacles: {rubble: {acton: push}}}\n"
        "obstacles: [{type: rubble, region: 7}]\n"
        "expect: {resolved: [rubble@7]}\n"
    )
    (tmp_path / "s.yaml").write_text(text)
    told = safenav("check", "s.yaml").stderr
    assert "unknown key 'acton'" in told
    assert "has no obstacles" not in told and "no obstacle" not in told


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "run.jsonl"], ["this is a trace", "safenav replay run.jsonl"]),
        (["replay", "s.yaml"], ["this is a scenario", "safenav run s.yaml --trace"]),
        (["check", "fleet.yaml"], ["this is a fleet file, not a scenario, trace", "safenav drive"]),
        (["drive", "s.yaml", "--fleet", "run.jsonl"], ["this is a trace, not a fleet file"]),
        (["check", "lab.motion.jsonl"], ["against its trace", "check lab.motion.jsonl TRACE"]),
        (["check", "s.slugs"], ["this is a specification", "safenav synth s.slugs"]),
        (["check", "s.json"], ["this is a strategy of slugs", "safenav verify SPECIFICATION"]),
        (["check", "matrix.yaml"], ["this is a matrix file", "safenav batch matrix.yaml"]),
        (["check", "n.zip"], ["this archive is not a bundle", "safenav certify"]),
        (["check", "."], ["this folder is not a bundle", "safenav batch ."]),
        (["check", "s.yaml", "--partial"], ["--partial is for traces; no such FILE is given"]),
        (["check-trace", "run.jsonl"], ["there is no command", "safenav check FILE"]),
        (["replay", "lab.motion.jsonl"], ["this is a motion file, not a trace"]),
        (["replay", "notes.txt"], ["notes.txt:1:1: this line is not JSON", "not a trace of"]),
        (["verify", "s.yaml", "x.json"], ["this is a scenario, not a specification"]),
        (["verify", "notes.txt", "x.json"], ["'one' is in no section", "such as [INPUT]"]),
        (["check", str(MAPS / "office.pgm")], ["this is an image (PGM)", "safenav draw"]),
        (["rn", "s.yaml"], ["there is no command 'rn'", "did you mean 'run'?"]),
        (["s.yaml"], ["there is no command 's.yaml'", "safenav run s.yaml"]),
        (["frobnicate"], ["there is no command", "safenav --help"]),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_the_wrong_kind_of_thing_is_recognized(
    arguments: list[str], words: list[str], safenav: Command, tmp_path: Path
) -> None:
    (tmp_path / "s.yaml").write_text(GOOD)
    (tmp_path / "run.jsonl").write_text('{"type":"header","trace":1}\n')
    (tmp_path / "lab.motion.jsonl").write_text('{"type":"header","motion":1}\n')
    (tmp_path / "fleet.yaml").write_text("safenav-fleet: 1\ntransport: ros2\n")
    with ZipFile(tmp_path / "n.zip", "w") as archive:
        archive.writestr("a", "b")
    (tmp_path / "notes.txt").write_text("one\ntwo\n")
    (tmp_path / "page.html").write_text("<!DOCTYPE html>\n<html></html>\n")
    (tmp_path / "s.slugs").write_text("[OUTPUT]\na\n")
    (tmp_path / "s.json").write_text('{"version": 0,\n "slugs": "0.0.1",\n "variables": []}\n')
    (tmp_path / "matrix.yaml").write_text("batch: 1\nscenario: s.yaml\n")
    found = safenav(*arguments)
    assert found.returncode == 2
    assert len(found.stderr.splitlines()) <= 3, found.stderr
    for word in words:
        assert word in found.stderr


def test_a_broken_archive_is_refused(safenav: Command, tmp_path: Path) -> None:
    with ZipFile(tmp_path / "b.zip", "w") as archive:
        archive.writestr("manifest.json", "{}" * 200)
    whole = (tmp_path / "b.zip").read_bytes()
    (tmp_path / "b.zip").write_bytes(whole[-60:])
    done = safenav("check", "b.zip")
    assert (done.returncode, done.stderr) == (1, "")
    assert "b.zip: refused" in done.stdout


@pytest.mark.parametrize("command", ["check", "run", "synth", "explain", "draw", "new --catalogue"])
def test_scenarios_are_read_from_standard_input(command: str, tmp_path: Path) -> None:
    done = warm.safenav(*command.split(), "-", cwd=tmp_path, text=GOOD)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_an_image_named_like_standard_input_is_a_file(safenav: Command, tmp_path: Path) -> None:
    drawn = GOOD[GOOD.index("  grid") : GOOD.index("robots")]
    text = GOOD.replace(drawn, "  image: '-'\n  rows: 3\n  cols: 5\n")
    (tmp_path / "s.yaml").write_text(text)
    assert "no such file" in safenav("check", "s.yaml").stderr


def test_a_cache_that_cannot_be_written_is_told_without_code(tmp_path: Path) -> None:
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


def test_an_output_on_a_full_disk_is_no_defect() -> None:
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


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_documented_with_its_exit_codes(command: str, safenav: Command) -> None:
    table = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert f"`safenav {command}" in table
    help_text = safenav(command, "--help").stdout
    assert "Exit codes:" in help_text
    assert "Example" in help_text
    assert len(help_text.splitlines()) <= 40


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
