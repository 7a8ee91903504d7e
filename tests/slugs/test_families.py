"""The generated benchmark families: real specifications, at sizes where that can be checked; and in
another order, which decides the shapes of all diagrams, but never a byte of the strategy. This
reaches games that are too large for the brute-force oracle."""

import sys
from pathlib import Path
from random import Random

import pytest

from slugs.conftest import STRATEGY, failure, run

FAMILIES = Path(__file__).resolve().parents[2] / "benchmarks" / "families.py"


def family(folder: Path, arguments: str) -> str:
    return run(Path(sys.executable), folder, FAMILIES, *arguments.split()).stdout


@pytest.mark.parametrize(
    ("arguments", "published"),
    [
        ("grid --rows 4 --cols 5", None),
        ("grid --rows 4 --cols 8 --walls", None),
        ("grid --rows 4 --cols 4 --adversary four", None),
        ("grid --rows 4 --cols 4 --adversary king --goals 9", None),
        ("regions --rows 3 --cols 5", None),
        ("regions --rows 4 --cols 4 --adversary four", None),
        ("requests --size 4 --goals 3", None),
        ("arbiter --clients 3", None),
        ("synt15 --masters 2", None),
        ("synt15 --masters 2 --coupled", None),
        ("genbuf --senders 2", 381),
        ("bunny --size 2", 230),
        ("bunny --size 4", 1074),
        ("belief --rows 5 --cols 5", None),
    ],
)
def test_a_family_of_games_is_won_without_a_deadlocked_environment(
    slugs_binary: Path, tmp_path: Path, arguments: str, published: int | None
) -> None:
    """Realizable, by a strategy that passes the check and never wins by a stuck environment; it has
    as many nodes as that of the published file of this size."""
    file, strategy = tmp_path / "family.structuredslugs", tmp_path / "strategy.json"
    file.write_text(family(tmp_path, arguments))
    solved = run(slugs_binary, tmp_path, *STRATEGY, file, strategy)
    assert "RESULT: Specification is realizable." in solved.stderr
    assert '"trans": []' not in strategy.read_text()
    assert published in (None, strategy.read_text().count('"rank"'))
    assert failure(file, strategy) is None


@pytest.fixture(
    scope="module",
    params=[
        "grid --rows 10 --cols 11 --adversary four",
        "grid --rows 20 --cols 20 --walls",
        "regions --rows 7 --cols 8 --adversary four",
        "arbiter --clients 7",
    ],
)
def specification(
    request: pytest.FixtureRequest, slugs_binary: Path, tmp_path_factory: pytest.TempPathFactory
) -> str:
    """A generated family in slugsin, where names and lines are easy to exchange."""
    folder = tmp_path_factory.mktemp("family")
    translated = run(slugs_binary, folder, "--translate", "-", text=family(folder, request.param))
    if translated.returncode != 0:
        pytest.skip(f"{slugs_binary} cannot translate")
    return translated.stdout


def _shuffled(text: str, source: Random) -> str:
    """Constraints in another order; variables and goals stay, for their order has a meaning."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    starts = [k for k, line in enumerate(lines) if line.startswith("[")]
    sections = [lines[a:b] for a, b in zip(starts, [*starts[1:], None], strict=True)]
    declared = [each for each in sections if each[0] in ("[INPUT]", "[OUTPUT]")]
    others = [each for each in sections if each not in declared]
    for k, (header, *constraints) in enumerate(others):
        if not header.endswith("_LIVENESS]"):
            source.shuffle(constraints)
        others[k] = [header, *constraints]
    source.shuffle(others)
    return "".join(f"{line}\n" for section in (*declared, *others) for line in section)


@pytest.mark.parametrize("flags", [(), ("--biasForAction",)], ids=["plain", "bias"])
def test_the_order_of_constraints_changes_no_byte(
    slugs_binary: Path, tmp_path: Path, specification: str, flags: tuple[str, ...]
) -> None:
    texts = [specification, *(_shuffled(specification, Random(seed)) for seed in range(3))]
    assert len({*texts}) == 4
    done = [run(slugs_binary, tmp_path, *STRATEGY, *flags, "-", text=text) for text in texts]
    assert all("RESULT: Specification is realizable." in each.stderr for each in done)
    assert len({each.stdout for each in done}) == 1
