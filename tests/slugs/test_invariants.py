"""The program with its assertions: `make slugs` builds it beside the release."""

from pathlib import Path
from random import Random

import pytest

from oracle import dense_game, random_specification
from oracle.duel import Abilities, Duel


@pytest.fixture
def duel(own_slugs: Path, tmp_path: Path) -> Duel:
    binary = own_slugs.with_name("slugs_asserting")
    if not binary.is_file():
        pytest.skip(f"no {binary}: `make slugs` builds it")
    return Duel(binary, tmp_path, Abilities())


@pytest.mark.parametrize("seed", range(40))
def test_no_invariant_breaks_in_random_games(duel: Duel, seed: int) -> None:
    specification = random_specification(Random(seed), integers=seed % 3 == 0, bits=3 + seed % 4)
    assert duel.disagreement(specification, seed) is None


@pytest.mark.parametrize("seed", range(6))
def test_no_invariant_breaks_where_diagrams_are_reordered(duel: Duel, seed: int) -> None:
    assert duel.disagreement(dense_game(Random(seed)), seed) is None


def test_very_many_variables_are_no_cliff(duel: Duel) -> None:
    """5,000 outputs follow 5,000 inputs: nothing is quadratic, no recursion overflows."""
    names = range(5000)
    (duel.folder / "pairs.slugsin").write_text(
        "[INPUT]\n"
        + "".join(f"i{k}\n" for k in names)
        + "[OUTPUT]\n"
        + "".join(f"o{k}\n" for k in names)
        + "[SYS_TRANS]\n"
        + "".join(f"! ^ o{k}' i{k}'\n" for k in names)
    )
    assert duel.run("--realizability", "pairs.slugsin").verdict == "realizable"
