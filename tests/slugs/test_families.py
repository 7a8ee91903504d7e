"""The generated benchmark families are real specifications, at sizes where that can be checked."""

import subprocess
import sys
from pathlib import Path

import pytest

from slugs.commands import STRATEGY, failure, run

FAMILIES = Path(__file__).resolve().parents[2] / "benchmarks" / "families.py"


def family(folder: Path, arguments: str) -> subprocess.CompletedProcess[str]:
    return run(Path(sys.executable), folder, FAMILIES, *arguments.split())


@pytest.mark.parametrize(
    "arguments",
    [
        "grid --rows 4 --cols 5",
        "grid --rows 4 --cols 8 --walls",
        "grid --rows 4 --cols 4 --adversary four",
        "grid --rows 4 --cols 4 --adversary king --goals 9",
        "regions --rows 3 --cols 5",
        "regions --rows 4 --cols 4 --adversary four",
        "requests --size 4 --goals 3",
        "arbiter --clients 3",
        "synt15 --masters 2",
        "synt15 --masters 2 --coupled",
        "genbuf --senders 2",
        "bunny --size 2",
        "belief --rows 5 --cols 5",
    ],
)
def test_family_is_won_by_moving(slugs_binary: Path, tmp_path: Path, arguments: str) -> None:
    """Realizable, by a strategy that passes the check and never wins by a stuck environment."""
    file, strategy = tmp_path / "family.structuredslugs", tmp_path / "strategy.json"
    file.write_text(family(tmp_path, arguments).stdout)
    solved = run(slugs_binary, tmp_path, *STRATEGY, file, strategy)
    assert "RESULT: Specification is realizable." in solved.stderr
    assert '"trans": []' not in strategy.read_text()
    assert failure(file, strategy) is None


@pytest.mark.parametrize(
    ("arguments", "nodes"),
    [("genbuf --senders 2", 381), ("bunny --size 2", 230), ("bunny --size 4", 1074)],
)
def test_a_regenerated_family_has_the_published_states(
    slugs_binary: Path, tmp_path: Path, arguments: str, nodes: int
) -> None:
    """So many nodes has the strategy of the published file of this size."""
    text = family(tmp_path, arguments).stdout
    (tmp_path / "family.structuredslugs").write_text(text)
    listed = run(slugs_binary, tmp_path, "--explicitStrategy", "family.structuredslugs")
    assert listed.stdout.count("State ") == nodes
