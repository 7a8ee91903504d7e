"""`--stats` tells the truth about the game, as far as brute force can tell it."""

import json
from pathlib import Path
from random import Random

import pytest

from oracle import (
    Game,
    build_game,
    dense_game,
    initial_states,
    inputs_first,
    is_realizable,
    members,
    random_specification,
    solve,
    to_slugsin,
    to_structuredslugs,
)
from oracle.duel import Abilities, Duel


@pytest.fixture
def duel(slugs_binary: Path, tmp_path: Path) -> Duel:
    duel = Duel(slugs_binary, tmp_path, Abilities())
    if "--stats" not in duel.run("--help").output:
        pytest.skip(f"{slugs_binary} has no --stats")
    return duel


def _reachable(game: Game) -> int:
    """The states that legal moves of both players can lead to."""
    reached = frontier = initial_states(game)
    while frontier:
        after = 0
        for state in members(frontier):
            for answers in game.moves[state].values():
                after |= answers
        frontier = after & ~reached
        reached |= after
    return reached


def test_statistics_agree_with_brute_force(duel: Duel) -> None:
    """Vacuous: the environment cannot start, or the system may win where it cannot move on."""
    vacuous = 0
    for seed in range(200):
        source = Random(seed)
        specification = inputs_first(random_specification(source, seed % 3 == 0, 3 + seed % 4))
        text = to_structuredslugs(specification, source)
        (duel.folder / "game.structuredslugs").write_text(text)
        answer = duel.run("--realizability", "--stats", "stats.json", "game.structuredslugs")
        stats = json.loads((duel.folder / "stats.json").read_text())
        game = build_game(specification)
        winning = solve(game).winning
        reachable = _reachable(game)
        stuck = [s for s in members(reachable & winning) if not game.moves[s]]
        expected = is_realizable(game, winning) and (bool(stuck) or not game.env_init)
        story = f"seed {seed}: {answer.errors}\n{text}\n{stats}"
        assert stats["vacuous_win"] == expected, story
        assert stats["reachable_states"] == len(members(reachable)), story
        assert stats["variables"] == len(specification.bits), story
        assert stats["verdict"] == answer.verdict, story
        vacuous += expected
    assert 10 <= vacuous <= 150


def test_dense_games_make_the_solver_reorder(duel: Duel) -> None:
    """The premise of the random games that are meant to exercise sifting and collection."""
    counts = []
    for seed in range(30):
        (duel.folder / "game.slugsin").write_text(
            to_slugsin(dense_game(Random(seed)), Random(seed))
        )
        duel.run("--realizability", "--stats", "stats.json", "game.slugsin")
        stats = json.loads((duel.folder / "stats.json").read_text())
        counts.append((stats["reorderings"], stats["collections"]))
    assert sum(reorderings > 0 for reorderings, _ in counts) >= 3
    assert all(collections > 0 for _, collections in counts)
