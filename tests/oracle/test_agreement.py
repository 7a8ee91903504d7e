"""The oracle's fixpoint against its model checker, and against published outputs.

That it finds no game unrealizable which is realizable, `slugs/test_random_games` shows: there the
counterstrategy of each of them is model checked.
"""

import csv
import hashlib
import os
from pathlib import Path

import pytest

from once import CORPUS
from oracle import (
    build_game,
    check_strategy,
    extract,
    from_json,
    is_realizable,
    read_slugsin,
    solve,
    to_json,
    to_text,
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
