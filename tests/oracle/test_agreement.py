"""The oracle's fixpoint against its model checker, and against published outputs.

That it finds no game unrealizable which is realizable, `slugs/test_random_games` shows: there the
counterstrategy of each of them is model checked.
"""

import csv
import hashlib
import os
from pathlib import Path
from random import Random

import pytest

from once import CORPUS
from oracle import (
    Game,
    Specification,
    build_game,
    check_strategy,
    extract,
    from_json,
    inputs_first,
    is_realizable,
    random_specification,
    read_slugsin,
    solve,
    to_json,
    to_slugsin,
    to_text,
)

BATCH = 25
GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "200"))


def _random(seed: int) -> Specification:
    return random_specification(Random(seed), integers=seed % 3 == 0, bits=3 + seed % 4)


@pytest.mark.parametrize("batch", range(GAMES // BATCH))
def test_strategies_of_the_fixpoint_hold_up_under_model_checking(batch: int) -> None:
    for seed in range(batch * BATCH, (batch + 1) * BATCH):
        game = build_game(_random(seed))
        solution, biased = solve(game), solve(game, bias_for_action=True)
        assert biased.winning == solution.winning, f"seed {seed}"
        if is_realizable(game, solution.winning):
            assert check_strategy(game, extract(solution)) == [], f"seed {seed}"
            assert check_strategy(game, extract(biased)) == [], f"seed {seed}, biased"


def test_both_verdicts_and_non_trivial_strategies_are_frequent() -> None:
    """The random games are worth playing."""
    games = [build_game(_random(seed)) for seed in range(400)]
    solved = [(game, solve(game)) for game in games]
    realizable = [s for game, s in solved if is_realizable(game, s.winning)]
    assert 120 <= len(realizable) <= 280
    assert sum(len(extract(solution).nodes) >= 8 for solution in realizable) >= 80
    assert sum(any(len(sets) > 2 for sets in solution.recorded) for solution in realizable) >= 80
    automata = [(s.game.specification, extract(s)) for s in realizable]
    assert sum(not a.nodes for _, a in automata) >= 10, "empty initial sets"
    assert sum(any(not n.successors for n in a.nodes) for _, a in automata) >= 10, "dead ends"
    shuffled = sum(a.nodes != () and inputs_first(s) != s for s, a in automata)
    assert shuffled >= 40, "outputs before inputs"
    for count in range(1, 5):
        some = sum(len(s.env_liveness) == count and len(a.nodes) >= 4 for s, a in automata)
        assert some >= 5, f"{count} assumptions"


def test_slugsin_is_read_as_it_is_written() -> None:
    for seed in range(300):
        source = Random(seed)
        specification = random_specification(source, bits=4)
        text = to_slugsin(specification, source)
        assert _plays(build_game(read_slugsin(text))) == _plays(build_game(specification)), text


def _plays(game: Game) -> tuple[object, ...]:
    return (
        game.specification.variables,
        game.env_init,
        game.sys_init,
        game.moves,
        game.assumptions,
        game.guarantees,
    )


def _corpus() -> Path:
    if not (CORPUS / "expected.csv").is_file():
        pytest.skip(f"no corpus at {CORPUS}; set SAFENAV_CORPUS")
    return CORPUS


@pytest.mark.parametrize(
    ("name", "listed"),
    [
        ("simple_safety_example", "simple_safety_example.slugsin"),
        ("semantics_diference", "semantics_diference.slugsin"),
        ("optimisticRecoveryTest", "optimisticRecoveryTest.slugsin"),
        ("firefighting", "firefighting.slugsin"),
        ("water_reservoir.translated", "water_reservoir.structuredslugs"),
        ("unrealizable1", "unrealizable1.slugsin"),
        ("unrealizable_waiter", "unrealizable_waiter.slugsin"),
        ("unrealizable_waiter2", "unrealizable_waiter2.slugsin"),
        pytest.param(
            *("baby_network", "baby_network.slugsin"),
            marks=pytest.mark.skipif(
                "SAFENAV_FUZZ" not in os.environ, reason="as long as all others, `make fuzz`"
            ),
        ),
    ],
    ids=lambda value: str(value).split(".")[0],
)
def test_published_files_give_the_published_bytes(name: str, listed: str) -> None:
    corpus = _corpus()
    with (corpus / "expected.csv").open() as table:
        expected = {row["file"]: row for row in csv.DictReader(table)}[f"slugs/{listed}"]
    game = build_game(read_slugsin((corpus / "slugs" / f"{name}.slugsin").read_text()))
    solution = solve(game)
    realizable = is_realizable(game, solution.winning)
    assert realizable == (expected["verdict"] == "realizable")
    if realizable:
        automaton = extract(solution)
        text = to_json(game.specification, automaton)
        assert hashlib.sha256(text.encode()).hexdigest() == expected["strategy_sha256"]
        assert check_strategy(game, automaton) == []
        assert from_json(game.specification, text) == automaton


def test_the_text_form_is_the_published_one() -> None:
    folder = _corpus() / "slugs"
    specification = read_slugsin((folder / "simple_safety_example.slugsin").read_text())
    automaton = extract(solve(build_game(specification)))
    published = (folder / "simple_safety_example.strategy.txt").read_text()
    assert to_text(specification, automaton) == published
