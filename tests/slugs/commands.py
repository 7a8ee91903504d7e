"""Commands to try, and how to run them."""

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from children import ran
from once import beside
from safenav import Strategy, first_failure
from safenav.synthesis.program import find_own_binary
from safenav.synthesis.slugs import load_specification

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
    named = os.environ.get("SAFENAV_SLUGS")
    if named:
        if not (Path(named).is_file() and os.access(named, os.X_OK)):
            pytest.fail(f"SAFENAV_SLUGS names no program: {named}")
        return Path(named).resolve()
    own = find_own_binary()
    if own is None:
        pytest.skip("no slugs binary: run `make install` or set SAFENAV_SLUGS")
    return own.path.resolve()


def run(
    binary: Path, folder: Path, *arguments: str | Path, text: str = "", **options: Any
) -> subprocess.CompletedProcess[str]:
    """Run the command in the folder. ``options``: as of ``subprocess.run``."""
    return ran([binary, *arguments], cwd=folder, input=text, **options)


def failure(file: Path, automaton: Path, *, counter: bool = False) -> str | None:
    """What safenav's verifier, which shares no code with slugs, finds wrong with an automaton."""
    specification = load_specification(file)
    strategy = Strategy.parse(automaton.read_bytes(), specification)
    return first_failure(specification, strategy, counter)
