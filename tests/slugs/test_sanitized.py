"""slugs once more with address and undefined-behaviour sanitizers: unit tests, fuzzers, games.

Builds into `slugs/build-sanitized`, or uses the build that SAFENAV_SLUGS_SANITIZED names.
"""

import os
import shutil
import subprocess
from pathlib import Path
from random import Random

import pytest

from once import locked
from oracle import random_specification
from oracle.duel import Abilities, Duel

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "slugs" / "build-sanitized"
FUZZER_RUNS = "4000"
FUZZER_SECONDS = "30"
GAMES = 30

pytestmark = pytest.mark.slow


def run(*command: str | Path, folder: Path = ROOT, minutes: int = 15) -> str:
    """Run a command that must succeed; its output."""
    done = subprocess.run(
        [*map(str, command)],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        timeout=300 * minutes,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-10_000:]
    return done.stdout


@pytest.fixture(scope="module")
def build() -> Path:
    """A build with assertions and sanitizers, optimized a little so that it is not too slow."""
    named = os.environ.get("SAFENAV_SLUGS_SANITIZED")
    if named:
        return Path(named).resolve()
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("no cmake on the path")
    with locked(BUILD / "lock"):
        run(
            *(cmake, "-S", ROOT / "slugs", "-B", BUILD, "-DCMAKE_BUILD_TYPE=None"),
            *("-DCMAKE_CXX_FLAGS=-O1", "-DCMAKE_UNITY_BUILD=ON", "-DSLUGS_SANITIZE=ON"),
            *("-DSLUGS_TESTS=ON", "-DSLUGS_FUZZ=ON"),
        )
        run(cmake, "--build", BUILD, "--parallel", "2")
    return BUILD


def test_unit_tests_pass_under_sanitizers(build: Path) -> None:
    """Every program of slugs/tests."""
    programs = [path for path in sorted(build.glob("test_*")) if os.access(path, os.X_OK)]
    assert len(programs) == len(list((ROOT / "slugs" / "tests").glob("test_*.cpp")))
    for program in programs:
        if program.is_file():
            assert " 0 failed" in run(program)


@pytest.mark.parametrize("reader", ["slugsin", "structured", "strategy"])
def test_a_bounded_fuzzing_run_finds_nothing(build: Path, tmp_path: Path, reader: str) -> None:
    """Mutations of seeds and of the shipped tests' texts; deterministic up to the time limit."""
    said = run(
        *(build / f"fuzz_{reader}", "--runs", FUZZER_RUNS, "--seconds", FUZZER_SECONDS),
        folder=tmp_path,
    )
    assert said.endswith("no finding\n")
    assert int(said.split()[0]) >= 500


def test_random_games_under_sanitizers(build: Path, tmp_path: Path) -> None:
    """All commands on small games, with all that the oracle knows about the answers."""
    duel = Duel(build / "slugs", tmp_path, Abilities())
    for seed in range(GAMES):
        specification = random_specification(Random(seed), integers=seed % 2 == 0, bits=5)
        assert duel.disagreement(specification, seed) is None, seed
    assert duel.games == GAMES


def test_bad_input_under_sanitizers(build: Path, tmp_path: Path) -> None:
    """Messages are the part of the program that sees the oddest texts."""
    for name, text in (
        ("nul", b"[INPUT]\nx:0...3\n[SYS_INIT]\nx\0 == \xff 3\nG F x U y\n"),
        ("deep", b"[OUTPUT]\na\n[SYS_INIT]\n" + b"(" * 50_000 + b"a"),
        ("long", b"[OUTPUT]\nx:0...3\n" + b"\xe2\x86\x92" * 50_000 + b"\na\n"),
        ("empty", b""),
    ):
        (tmp_path / name).write_bytes(text)
        done = subprocess.run(
            [build / "slugs", name], cwd=tmp_path, capture_output=True, check=False, timeout=300
        )
        assert done.returncode == 2, done.stderr[-10_000:]
        assert b"Sanitizer" not in done.stderr
