"""A specification in another order has the same strategy, byte for byte.

The order of the constraints decides where the solver's variable order starts, hence the shapes of
all its diagrams, but never a byte of the strategy.  This reaches games that are too large for the
brute-force oracle.
"""

import sys
from pathlib import Path
from random import Random

import pytest

from slugs.commands import STRATEGY, run

ROOT = Path(__file__).resolve().parents[2]

FAMILIES = [
    "grid --rows 10 --cols 11 --adversary four",
    "grid --rows 20 --cols 20 --walls",
    "regions --rows 7 --cols 8 --adversary four",
    "arbiter --clients 7",
]


@pytest.fixture(scope="module", params=FAMILIES)
def specification(
    request: pytest.FixtureRequest, slugs_binary: Path, tmp_path_factory: pytest.TempPathFactory
) -> str:
    """A generated family in slugsin, where names and lines are easy to exchange."""
    families, folder = ROOT / "benchmarks" / "families.py", tmp_path_factory.mktemp("family")
    text = run(Path(sys.executable), folder, families, *str(request.param).split()).stdout
    translated = run(slugs_binary, folder, "--translate", "-", text=text)
    if translated.returncode != 0:
        pytest.skip(f"{slugs_binary} cannot translate")
    return translated.stdout


def _strategy(binary: Path, text: str, *flags: str) -> str:
    process = run(binary, Path.cwd(), *STRATEGY, *flags, "-", text=text)
    assert "RESULT: Specification is realizable." in process.stderr, process.stderr
    return process.stdout


def _sections(text: str) -> list[tuple[str, list[str]]]:
    sections: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        if line.startswith("["):
            sections.append((line, []))
        elif line.strip() and not line.startswith("#"):
            sections[-1][1].append(line)
    return sections


def _joined(sections: list[tuple[str, list[str]]]) -> str:
    return "\n".join(line for header, lines in sections for line in [header, *lines, ""]) + "\n"


def _shuffled(text: str, source: Random) -> str:
    """Constraints in another order; variables and goals stay, for their order has a meaning."""
    sections = _sections(text)
    for header, lines in sections:
        if header.endswith(("_TRANS]", "_INIT]")):
            source.shuffle(lines)
    declared = [s for s in sections if s[0] in ("[INPUT]", "[OUTPUT]")]
    others = [s for s in sections if s not in declared]
    source.shuffle(others)
    return _joined(declared + others)


@pytest.mark.parametrize("flags", [(), ("--biasForAction",)], ids=["plain", "bias"])
def test_order_of_constraints_changes_no_byte(
    slugs_binary: Path, specification: str, flags: tuple[str, ...]
) -> None:
    expected = _strategy(slugs_binary, specification, *flags)
    for seed in range(3):
        text = _shuffled(specification, Random(seed))
        assert text != specification
        assert _strategy(slugs_binary, text, *flags) == expected
