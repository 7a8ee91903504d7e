"""`slugs --check` and the oracle's checker must agree on automata that have been tampered with."""

from collections import Counter
from pathlib import Path
from random import Random

import pytest

from oracle import (
    Automaton,
    Game,
    build_game,
    check_counterstrategy,
    check_strategy,
    extract,
    initial_states,
    is_realizable,
    random_specification,
    solve,
    to_json,
    to_structuredslugs,
)
from oracle.damage import DAMAGES, Damage, no_memory, reachable
from oracle.duel import Abilities, Duel
from oracle.rendering import inputs_first

GAMES = 150


@pytest.fixture
def duel(slugs_binary: Path, tmp_path: Path) -> Duel:
    duel = Duel(slugs_binary, tmp_path, Abilities())
    if "--check" not in duel.run("--help").output:
        pytest.skip(f"{slugs_binary} has no --check")
    return duel


def _certificate(duel: Duel, game: Game) -> tuple[Automaton, bool]:
    """An automaton for the winner, and whether that is the system."""
    solution = solve(game)
    if is_realizable(game, solution.winning):
        return extract(solution), True
    return duel.counterstrategy(game.specification), False


def _starts(game: Game, automaton: Automaton) -> list[int]:
    legal = initial_states(game)
    return [i for i, node in enumerate(automaton.nodes) if legal >> node.state & 1]


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_damage_is_found_if_and_only_if_it_matters(duel: Duel, damage: Damage) -> None:
    """Both verdicts; each rejection has a reason that names the kind of automaton or a node."""
    outcomes: Counter[tuple[bool, bool]] = Counter()
    cycles = 0
    # Few games have memory to confuse.
    for seed in range(GAMES * (4 if damage is no_memory else 1)):
        source = Random(seed)
        specification = inputs_first(random_specification(source, seed % 3 == 0, 3 + seed % 3))
        game = build_game(specification)
        sound, system_wins = _certificate(duel, game)
        if not any(node.successors for node in sound.nodes):
            continue
        automaton = damage(sound, _starts(game, sound), source)
        check = check_strategy if system_wins else check_counterstrategy
        complaints = check(game, automaton)
        starts = _starts(game, automaton)
        if not complaints and not (reachable(automaton, starts) and 0 in starts):
            continue  # sound, but with nodes that --check rightly calls superfluous
        text = to_structuredslugs(specification, source)
        (duel.folder / "game.structuredslugs").write_text(text)
        (duel.folder / "automaton.json").write_text(to_json(specification, automaton))
        kind = [] if system_wins else ["--counterStrategy"]
        answer = duel.run(*kind, "--check", "automaton.json", "game.structuredslugs")
        story = f"seed {seed}: {complaints}\n{text}\n{to_json(specification, automaton)}"
        assert answer.status in (0, 1), story + answer.errors
        assert (answer.status == 1) == bool(complaints), story + answer.output + answer.errors
        assert answer.status == 0 or (answer.output + answer.errors).strip(), story
        outcomes[system_wins, bool(complaints)] += 1
        cycles += any("starve" in c or "can satisfy" in c for c in complaints[:1])
    assert outcomes[True, True] >= 5, "no broken strategy was tried"
    assert outcomes[False, True] >= 5, "no broken counterstrategy was tried"
    assert cycles >= 10 or damage is not no_memory, "no goal was starved"
