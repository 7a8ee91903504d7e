"""Bad input and broken tools: a clear message, the right exit code, never a traceback."""

import sys
from pathlib import Path

import pytest

from cli.conftest import Command
from once import SCENARIOS

HELLO = SCENARIOS / "hello.yaml"
LONG = "n" * 5000

FAKES = {
    "crashes": ("kill -SEGV $$", 4, "SIGSEGV"),
    "prints garbage": ("echo nonsense; exit 0", 4, "no verdict"),
    "prints no JSON": (
        "echo 'RESULT: Specification is realizable.' >&2; echo '{'; exit 0",
        4,
        "JSON",
    ),
    "prints nothing": ("exit 0", 4, "no verdict"),
}


def fake(tmp_path: Path, script: str) -> Path:
    binary = tmp_path / "fake slugs"
    binary.write_text(f"#!/bin/bash\ncat > /dev/null\n{script}\n")
    binary.chmod(0o755)
    return binary


@pytest.mark.parametrize("command", ["run", "check", "synth"])
def test_broken_scenario_is_told_with_its_place(
    safenav: Command, tmp_path: Path, command: str
) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text(HELLO.read_text().replace("model: digit", "model: digti"))
    done = safenav(command, broken)
    assert done.returncode == 2
    assert f"{broken}:13:" in done.stderr
    assert "digit" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "nowhere.yaml"),
        ("run",),
        ("run", HELLO, "--max-ticks", "0"),
        ("run", HELLO, "--sede", "1"),
        ("run", HELLO, "--time-limit", "nan"),
        ("run", HELLO, "--time-limit", "inf"),
        ("run", HELLO, "--clock", "live", "--operator", "nowhere.txt"),
        ("run", HELLO, "--clock", "live", "--operator", sys.executable),
        ("fly", HELLO),
        ("synth", HELLO, "--robot", "nobody"),
        ("synth", HELLO, "-o", "/dev/null/out"),
        ("new", "s.yaml", "--map", LONG),
        ("run", HELLO, "-o", LONG),
        ("synth", HELLO, "-o", LONG),
        ("batch", HELLO, "-o", LONG),
        ("studio", f"{LONG}.yaml", "--no-browser"),
    ],
    ids=lambda arguments: " ".join(Path(str(a)).name[:12] for a in arguments),
)
def test_bad_usage_is_exit_2_without_traceback(
    safenav: Command, arguments: tuple[object, ...]
) -> None:
    done = safenav(*arguments)
    assert done.returncode == 2
    assert done.stderr.strip()
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", FAKES)
def test_synthesizer_that_misbehaves(safenav: Command, tmp_path: Path, name: str) -> None:
    script, code, words = FAKES[name]
    trace = tmp_path / "t.jsonl"
    binary = fake(tmp_path, script)
    done = safenav("run", HELLO, "--trace", trace, SAFENAV_SLUGS=str(binary))
    assert done.returncode == code, done.stderr
    assert words.lower() in done.stderr.lower()
    assert "Traceback" not in done.stderr
    assert '"outcome":"error"' in trace.read_text().splitlines()[-1]


def test_synthesizer_that_hangs_is_a_resource_limit(safenav: Command, tmp_path: Path) -> None:
    slow = tmp_path / "slow.yaml"
    slow.write_text(
        HELLO.read_text().replace("{ticks: 100}", "{ticks: 100, synthesis_seconds: 0.3}")
    )
    done = safenav("run", slow, SAFENAV_SLUGS=str(fake(tmp_path, "sleep 60")))
    assert done.returncode == 3
    assert "timeout" in done.stderr
    assert "synthesis_seconds" in done.stderr


def test_missing_synthesizer_names_the_variable(safenav: Command) -> None:
    done = safenav("run", HELLO, SAFENAV_SLUGS="/nowhere/slugs")
    assert done.returncode == 4
    assert "SAFENAV_SLUGS" in done.stderr


def test_help_has_examples_and_exit_codes(safenav: Command) -> None:
    assert "Exit codes" in safenav("--help").stdout
    for command in ("run", "synth", "check"):
        text = safenav(command, "--help").stdout
        assert "Examples" in text
        assert "Exit codes" in text
