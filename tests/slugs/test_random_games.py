"""Random games: slugs must say what the brute-force oracle says, to the byte.

`SAFENAV_RANDOM_GAMES` sets the number of games: few for a slow (sanitized) binary, many for a long
night; `SAFENAV_FUZZ_FIRST` shifts their seeds. `make fuzz` plays thousands.
"""

import os
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from oracle.duel import Duel
from oracle.generator import deep_formulas, dense_game, independent_game, random_specification
from oracle.specification import Specification
from oracle.text import to_slugsin
from slugs.commands import STRATEGY, run

BATCH = 50
GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "200"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))

Draw = Callable[[Random, int], Specification]
KINDS: dict[str, tuple[int, Draw]] = {
    "small": (1, lambda r, seed: random_specification(r, seed % 3 == 0, bits=3 + seed % 4)),
    # Long lists of assumptions and guarantees: the order of goals and ranks matters.
    "goals": (5, lambda r, _: random_specification(r, bits=4, many_goals=True)),
    # Longer plays than in the tiny games.
    "longer": (5, lambda r, seed: random_specification(r, seed % 2 == 0, bits=8)),
    # Thousands of nodes at 2,048 states: sifting and collection must not change a byte.
    "dense": (50, lambda r, _: dense_game(r)),
    # Solved and listed with one relation for each part.
    "independent": (8, lambda r, _: independent_game(r)),
    # Precedence, aliases, sums and buffers, nested.
    "deep": (4, lambda r, seed: deep_formulas(r, integers=seed % 2 == 0)),
}
"""Kinds of games: one of so many games is of this kind, and how it is drawn."""
BATCHES = [
    pytest.param(
        kind,
        range(first, min(first + BATCH, count)),
        id=f"{kind}-{first}",
        marks=[pytest.mark.slow] * (kind == "dense"),
    )
    for kind, (share, _) in KINDS.items()
    for count in [-(-GAMES // share)]
    for first in range(0, count, BATCH)
]


@pytest.fixture
def duel(own_slugs: Path, tmp_path: Path) -> Duel:
    return Duel(own_slugs, tmp_path)


@pytest.mark.parametrize(("kind", "seeds"), BATCHES)
def test_random_games_are_played_as_by_the_oracle(duel: Duel, kind: str, seeds: range) -> None:
    """Both languages; both flags, alone and together; every counterstrategy checked; of deep
    formulas, every translation compared."""
    if kind == "deep":
        duel = Duel(duel.binary, duel.folder, translations=1.0)
    for seed in (FIRST + each for each in seeds):
        difference = duel.disagreement(KINDS[kind][1](Random(seed), seed), seed)
        assert difference is None, f"seed {seed}: {difference}"
    assert duel.games == len(seeds)
    if kind == "small":
        assert duel.strategies > len(seeds)
        assert duel.counterstrategies > 0


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
