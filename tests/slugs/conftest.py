"""The programs under test, commands to try on a folder of specifications, and how to run them."""

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

import warm
from children import ran
from once import ROOT, beside
from safenav import Synthesizer, SynthesizerError

# The robot follows a light that returns infinitely often.
FOLLOW = beside(__file__, "specifications/follow.structuredslugs")
# The same, but the robot cannot move.
STUCK = FOLLOW.replace("at' <= at + 1", "at' = at").replace("at' = light'", "at' = 1")
# A counter that takes 2^30 steps to its goal, too many to wait for.
ENDLESS = beside(__file__, "specifications/endless.structuredslugs")
# All different: the diagram has a node for each subset of the values.
CROWDED = (
    "[OUTPUT]\n"
    + "".join(f"x{i}: 0...15\n" for i in range(12))
    + "[SYS_TRANS]\n"
    + "".join(f"x{i}' != x{j}'\n" for i in range(12) for j in range(i))
)
STRATEGY = ("--explicitStrategy", "--jsonOutput")


def binary_under_test() -> Path:
    """The binary that came with safenav, or that SAFENAV_SLUGS names. Without one the test is
    skipped, unless one was asked for."""
    try:
        return Synthesizer().binary.resolve()
    except SynthesizerError as error:
        if "SAFENAV_SLUGS" in os.environ:
            pytest.fail(str(error))
        pytest.skip("no slugs binary: run `make install` or set SAFENAV_SLUGS")


def run(
    binary: Path, folder: Path, *arguments: str | Path, text: str = "", **options: Any
) -> subprocess.CompletedProcess[str]:
    """Run the command in the folder. ``options``: as of ``subprocess.run``."""
    return ran([binary, *arguments], cwd=folder, input=text, **options)


def failure(file: Path, automaton: Path, *, counter: bool = False) -> str | None:
    """What `safenav verify`, which shares no code with slugs, finds wrong with an automaton."""
    done = warm.safenav("verify", file, automaton, *["--counterstrategy"] * counter)
    return done.stdout + done.stderr if done.returncode else None


@pytest.fixture(scope="session")
def slugs_binary() -> Path:
    return binary_under_test()


@pytest.fixture(scope="session")
def sanitized() -> Path:
    """The binary with assertions and sanitizers: SAFENAV_SLUGS_SANITIZED names another build."""
    named = os.environ.get("SAFENAV_SLUGS_SANITIZED")
    binary = (Path(named) if named else ROOT / "slugs" / "build-sanitized") / "slugs"
    if not binary.is_file():
        pytest.skip(f"no {binary}: run `make slugs-test`")
    return binary.resolve()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with specifications to try commands on."""
    for name, text in (
        ("follow", FOLLOW),
        ("stuck", STUCK),
        ("endless", ENDLESS),
        ("crowded", CROWDED),
        ("broken", "[INPUT]\nx: 0...\n"),
    ):
        (tmp_path / f"{name}.structuredslugs").write_text(text)
    return tmp_path
