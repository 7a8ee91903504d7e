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
        ("run", "nowhere.yaml"),
        ("run",),
        ("run", HELLO, "--max-ticks", "0"),
        ("run", HELLO, "--sede", "1"),
        ("run", HELLO, "--time-limit", "nan"),
        ("run", HELLO, "--clock", "live", "--operator", "nowhere.txt"),
        ("run", HELLO, "--clock", "live", "--operator", sys.executable),
        ("run", HELLO, "--live", "--no-verify"),
        ("fly", HELLO),
        ("synth", HELLO, "--robot", "nobody"),
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


UNREADABLE = [
    ("check", "loop", "Too many levels of symbolic links"),
    ("check", "binary", "not UTF-8"),
    ("check", "binary.jsonl", "the first line is incomplete"),
    ("new s.yaml --side 1 --map", ".", "this is a directory"),
    ("batch hello.yaml --baseline", "deep", "it is not JSON: too deeply nested"),
    ("verify lift.slugs", "deep", "deep: the strategy is not JSON: too deeply nested"),
    ("synth", "fire.spec", "as LTLMoP and TuLiP write them"),
    ("check", "plan.py", "plan.py: this is a Python program, not a scenario"),
    ("check", "rooms.pddl", "rooms.pddl: neither a scenario (YAML) nor a specification"),
    ("check", "random-1.scen", "then each as [ROW, COLUMN]"),
    ("run", "floor.sdf", "occupancy map (ROS map_saver)"),
    ("run", "arm.urdf", "safenav new --catalogue"),
    ("synth", "next.slugs", "next.slugs:4:9: unexpected '!='"),
]


@pytest.mark.parametrize(
    ("command", "name", "told"), UNREADABLE, ids=[f"{c} {n}" for c, n, _ in UNREADABLE]
)
def test_a_file_that_cannot_be_read_is_named(
    safenav: Command, command: str, name: str, told: str, tmp_path: Path
) -> None:
    (tmp_path / "loop").symlink_to("loop")
    for binary in ("binary", "binary.jsonl"):
        (tmp_path / binary).write_bytes(b"\xff\xfe\x00")
    (tmp_path / "deep").write_text("[" * 100_000)
    (tmp_path / "hello.yaml").write_text(HELLO.read_text())
    (tmp_path / "random-1.scen").write_text("version 1\n0\tr.map\t8\t8\t1\t2\t3\t4\t5.0\n")
    for other in ("floor.sdf", "arm.urdf"):
        (tmp_path / other).write_text("<?xml version='1.0'?>\n<sdf/>\n")
    (tmp_path / "lift.slugs").write_text("[OUTPUT]\nx\n[SYS_LIVENESS]\nx\n")
    (tmp_path / "next.slugs").write_text("[OUTPUT]\nx: 0...4\n[SYS_TRANS]\nnext(x) != 3\n")
    (tmp_path / "fire.spec").write_text("Actions: # enabled: 1\nSensors: person, 1\n Env: false\n")
    (tmp_path / "plan.py").write_text("from safenav import load_scenario\n")
    (tmp_path / "rooms.pddl").write_text("(define (domain rooms)\n (:requirements :strips))\n")
    done = safenav(*command.split(), name)
    assert (done.returncode, told in done.stderr) == (2, True), done.stderr


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


def test_missing_synthesizer_names_the_variable(safenav: Command) -> None:
    done = safenav("run", HELLO, SAFENAV_SLUGS="/nowhere/slugs")
    assert done.returncode == 4
    assert "SAFENAV_SLUGS" in done.stderr
