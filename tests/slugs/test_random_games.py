"""Random games: slugs must say what the brute-force oracle says, to the byte.

`SAFENAV_RANDOM_GAMES` sets the number of games: few for a slow (sanitized) binary, many for a long
night; `SAFENAV_FUZZ_FIRST` shifts their seeds. `make fuzz` plays thousands.
"""

import os
from pathlib import Path
from random import Random

import pytest

from oracle.duel import Duel
from oracle.generator import deep_formulas, dense_game, independent_game, random_specification
from oracle.rendering import to_slugsin
from oracle.specification import Specification
from slugs.commands import STRATEGY, run

BATCH = 50
GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "200"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
BATCHES = range((GAMES + BATCH - 1) // BATCH)
DENSE = range((GAMES + 59) // 60)
DEEP = range((GAMES + 249) // 250)


@pytest.fixture
def duel(own_slugs: Path, tmp_path: Path) -> Duel:
    return Duel(own_slugs, tmp_path)


@pytest.mark.parametrize("batch", BATCHES)
def test_random_games_are_played_as_by_the_oracle(duel: Duel, batch: int) -> None:
    """Both languages; both flags, alone and together; every counterstrategy checked."""
    for seed in range(FIRST + batch * BATCH, FIRST + (batch + 1) * BATCH):
        specification = random_specification(
            Random(seed), integers=seed % 3 == 0, bits=3 + seed % 4
        )
        _compare(duel, specification, seed)
    assert duel.games == BATCH
    assert duel.strategies > BATCH
    assert duel.counterstrategies > 0


@pytest.mark.parametrize("seed", range(40))
def test_games_with_many_goals_are_played_as_by_the_oracle(duel: Duel, seed: int) -> None:
    """Long lists of assumptions and guarantees: the order of goals and ranks matters."""
    seed += FIRST
    specification = random_specification(Random(seed), bits=4, many_goals=True)
    assert len(specification.sys_liveness) >= 6
    _compare(duel, specification, seed)


def test_the_verdict_alone_takes_shortcuts_to_the_same_end(
    slugs_binary: Path, tmp_path: Path
) -> None:
    """Without a strategy a goal may be reached by way of others, see reached_goals.hpp."""
    file = tmp_path / "game.slugsin"
    verdicts = []
    for seed in range(FIRST, FIRST + 150):
        game = random_specification(Random(seed), bits=4 + seed % 4, many_goals=True)
        file.write_text(to_slugsin(game, Random(seed)))
        alone, strategy = (
            run(slugs_binary, tmp_path, *options, file).returncode for options in ((), STRATEGY)
        )
        assert alone == strategy, f"seed {seed}: {file.read_text()}"
        verdicts.append(alone)
    assert {0, 10} == set(verdicts)


@pytest.mark.parametrize("seed", range(40))
def test_longer_games_are_played_as_by_the_oracle(duel: Duel, seed: int) -> None:
    """Longer plays than in the tiny games."""
    seed += FIRST
    _compare(duel, random_specification(Random(seed), integers=seed % 2 == 0, bits=8), seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", DENSE)
def test_games_that_need_reordering_are_played_as_by_the_oracle(duel: Duel, seed: int) -> None:
    """Thousands of nodes at 2,048 states: sifting and collection must not change a byte."""
    _compare(duel, dense_game(Random(FIRST + seed)), seed)


@pytest.mark.parametrize("batch", DENSE)
def test_independent_environment_parts_are_played_as_by_the_oracle(duel: Duel, batch: int) -> None:
    """Solved and listed with one relation for each part."""
    for seed in range(FIRST + batch * 6, FIRST + (batch + 1) * 6):
        _compare(duel, independent_game(Random(seed)), seed)


@pytest.mark.parametrize("batch", DEEP)
def test_deep_formulas_are_read_as_they_are_meant(duel: Duel, batch: int) -> None:
    """Precedence, aliases, sums and buffers, nested; the translation is compared each time."""
    eager = Duel(duel.binary, duel.folder, translations=1.0)
    for seed in range(FIRST + batch * BATCH, FIRST + (batch + 1) * BATCH):
        _compare(eager, deep_formulas(Random(seed), integers=seed % 2 == 0), seed)


def _compare(duel: Duel, specification: Specification, seed: int) -> None:
    difference = duel.disagreement(specification, seed)
    assert difference is None, f"seed {seed}: {difference}"
