"""Bad input and broken tools: a clear message, the right exit code, never a traceback."""

import sys
from pathlib import Path

import pytest

from cli.conftest import Command
from once import SCENARIOS

HELLO = SCENARIOS / "hello.yaml"
LONG = "n" * 5000


def fake(tmp_path: Path, script: str) -> Path:
    binary = tmp_path / "fake slugs"
    binary.write_text(f"#!/bin/bash\ncat > /dev/null\n{script}\n")
    binary.chmod(0o755)
    return binary


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", HELLO, "--clock", "live", "--operator", sys.executable),
        ("synth", HELLO, "-o", "/dev/null/out"),
        ("new", "s.yaml", "--map", LONG),
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
