"""slugs with assertions and with address and undefined-behaviour sanitizers: fuzzers and games.

`make slugs-test` builds it, and runs the unit tests in it. `SAFENAV_RANDOM_GAMES` and
`SAFENAV_FUZZ_FIRST` as for the release (`test_random_games.py`): a fifth as many games.
"""

import os
import subprocess
from pathlib import Path
from random import Random

import pytest

from oracle.duel import Duel
from oracle.generator import dense_game, random_specification

GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "120")) // 5
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
FUZZER_RUNS = "4000"
FUZZER_SECONDS = "30"


@pytest.fixture
def duel(sanitized: Path, tmp_path: Path) -> Duel:
    return Duel(sanitized / "slugs", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["slugsin", "structured"])
def test_readers_survive_bounded_fuzzing(sanitized: Path, tmp_path: Path, reader: str) -> None:
    """Mutations of seeds and of the shipped tests' texts; deterministic up to the time limit."""
    done = subprocess.run(
        [sanitized / f"fuzz_{reader}", "--runs", FUZZER_RUNS, "--seconds", FUZZER_SECONDS],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        timeout=900,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-10_000:]
    assert done.stdout.endswith("no finding\n")
    assert int(done.stdout.split()[0]) >= 500


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FIRST, FIRST + GAMES))
def test_random_games_raise_no_sanitizer_report(duel: Duel, seed: int) -> None:
    """All commands on small games, with all that the oracle knows about the answers."""
    specification = random_specification(Random(seed), integers=seed % 3 == 0, bits=3 + seed % 4)
    assert duel.disagreement(specification, seed) is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FIRST, FIRST + GAMES // 6))
def test_reordering_games_raise_no_sanitizer_report(duel: Duel, seed: int) -> None:
    assert duel.disagreement(dense_game(Random(seed)), seed) is None


@pytest.mark.slow
def test_five_thousand_variables_are_solved_without_overflow(duel: Duel) -> None:
    """2,500 outputs follow 2,500 inputs: nothing is quadratic, no recursion overflows."""
    names = range(2500)
    (duel.folder / "pairs.slugsin").write_text(
        "[INPUT]\n"
        + "".join(f"i{k}\n" for k in names)
        + "[OUTPUT]\n"
        + "".join(f"o{k}\n" for k in names)
        + "[SYS_TRANS]\n"
        + "".join(f"! ^ o{k}' i{k}'\n" for k in names)
    )
    assert duel.run("--realizability", "pairs.slugsin").returncode == 0
