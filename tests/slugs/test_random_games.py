"""Random games: slugs must say what the brute-force oracle says, to the byte; also its build with
assertions and sanitizers (`make slugs-test`), and that survives the fuzzers of its readers.

`SAFENAV_RANDOM_GAMES` sets the number of games: few for a slow (sanitized) binary, many for a long
night; `SAFENAV_FUZZ_FIRST` shifts their seeds. `make fuzz` plays thousands.
"""

import os
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from children import ran
from oracle.automata import to_json, to_text
from oracle.duel import Duel
from oracle.game import build_game, extract, solve
from oracle.generator import deep_formulas, dense_game, independent_game, random_specification
from oracle.specification import Specification
from oracle.text import read_slugsin, to_slugsin
from slugs.conftest import STRATEGY, run

BATCH = 50
GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "200"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))

Draw = Callable[[Random, int], Specification]


def small(source: Random, seed: int) -> Specification:
    return random_specification(source, integers=seed % 3 == 0, bits=3 + seed % 4)


def dense(source: Random, _: int) -> Specification:
    """Thousands of nodes at 2,048 states: sifting and collection must not change a byte."""
    return dense_game(source)


KINDS: dict[str, tuple[int, Draw]] = {
    "small": (1, small),
    # Long lists of assumptions and guarantees: the order of goals and ranks matters.
    "goals": (5, lambda r, _: random_specification(r, bits=4, many_goals=True)),
    # Longer plays than in the tiny games.
    "longer": (5, lambda r, seed: random_specification(r, seed % 2 == 0, bits=8)),
    "dense": (50, dense),
    # Solved and listed with one relation for each part.
    "independent": (8, lambda r, _: independent_game(r)),
    # Precedence, aliases, sums and buffers, nested; every translation is compared.
    "deep": (4, lambda r, seed: deep_formulas(r, integers=seed % 2 == 0)),
    "sanitized small": (8, small),
}
"""Kinds of games: one of so many games is of this kind, and how it is drawn."""
SLOW = ("dense", "sanitized small")
"""Played by both builds."""


def batches() -> list[object]:
    found = list[object]()
    for kind, (share, _) in KINDS.items():
        count, size = -(-GAMES // share), {"dense": 2, "sanitized small": 5}.get(kind, BATCH)
        for first in range(0, count, size):
            seeds, marks = range(first, min(first + size, count)), [pytest.mark.slow]
            name = f"{kind}-{first}"
            found.append(pytest.param(kind, seeds, id=name, marks=marks * (kind in SLOW)))
    return found


@pytest.mark.parametrize(("kind", "seeds"), batches())
def test_slugs_and_oracle_play_random_games_alike(
    kind: str, seeds: range, slugs_binary: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Both languages; both flags, alone and together; every counterstrategy checked."""
    other = request.getfixturevalue("sanitized") if kind in SLOW else None
    duel = Duel(slugs_binary, tmp_path, other, translations=1.0 if kind == "deep" else 0.3)
    for seed in (FIRST + each for each in seeds):
        difference = duel.disagreement(KINDS[kind][1](Random(seed), seed), seed)
        assert difference is None, f"seed {seed}: {difference}"
    if kind == "small":
        assert duel.strategies > len(seeds)
        assert duel.counterstrategies > 0


def test_the_verdict_is_the_same_without_a_strategy(slugs_binary: Path, tmp_path: Path) -> None:
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


SPECIFICATIONS = Path(__file__).with_name("specifications")


@pytest.mark.parametrize("name", ["no_start", "output_first", "dead_end"])
def test_oracle_and_slugs_print_the_bytes_of_published_slugs(slugs_binary: Path, name: str) -> None:
    """Without nodes no blank lines; variables in the order of a slugsin file; without successors a
    line that ends after the colon."""
    file = SPECIFICATIONS / f"{name}.slugsin"
    automaton = extract(solve(build_game(read_slugsin(file.read_text()))))
    for suffix, options, said in (
        ("json", STRATEGY, to_json(automaton)),
        ("txt", STRATEGY[:1], to_text(automaton)),
    ):
        expected = file.with_suffix(f".{suffix}").read_text()
        done = run(slugs_binary, SPECIFICATIONS, *options, file)
        assert "RESULT: Specification is realizable." in done.stderr
        assert done.stdout == expected == said


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["slugsin", "structured"])
def test_readers_survive_bounded_fuzzing(sanitized: Path, tmp_path: Path, reader: str) -> None:
    """Mutations of seeds and of the shipped tests' texts; deterministic up to the time limit."""
    fuzzer = sanitized.with_name(f"fuzz_{reader}")
    done = ran([fuzzer, "--runs", 4000, "--seconds", 30], cwd=tmp_path, errors="replace")
    assert done.returncode == 0, (done.stdout + done.stderr)[-10_000:]
    assert done.stderr.endswith("no finding\n")
    assert int(done.stderr.split()[0]) >= 500


@pytest.mark.slow
def test_five_thousand_variables_are_solved_without_overflow(
    sanitized: Path, tmp_path: Path
) -> None:
    """2,500 outputs follow 2,500 inputs: nothing is quadratic, no recursion overflows."""
    inputs, outputs = ([f"{side}{k}" for k in range(2500)] for side in "io")
    rules = [f"! ^ {o}' {i}'" for o, i in zip(outputs, inputs, strict=True)]
    text = "\n".join(["[INPUT]", *inputs, "[OUTPUT]", *outputs, "[SYS_TRANS]", *rules, ""])
    done = run(sanitized, tmp_path, "--realizability", "-", text=text)
    assert done.returncode == 0, done.stderr
