"""The generated benchmark families are real specifications, at sizes where that can be checked."""

import subprocess
import sys
from pathlib import Path

import pytest

FAMILIES = Path(__file__).resolve().parents[2] / "benchmarks" / "families.py"


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
    printed = subprocess.run(
        [sys.executable, FAMILIES, *arguments.split()], capture_output=True, text=True, check=True
    )
    file, strategy = tmp_path / "family.structuredslugs", tmp_path / "strategy.json"
    file.write_text(printed.stdout)
    solved = subprocess.run(
        [slugs_binary, "--explicitStrategy", "--jsonOutput", file, strategy],
        capture_output=True,
        text=True,
        check=False,
    )
    assert "RESULT: Specification is realizable." in solved.stderr
    assert '"trans": []' not in strategy.read_text()
    checked = subprocess.run(
        [slugs_binary, "--check", strategy, file], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.mark.parametrize(
    ("arguments", "nodes"),
    [("genbuf --senders 2", 381), ("bunny --size 2", 230), ("bunny --size 4", 1074)],
)
def test_a_written_family_is_the_published_one(
    slugs_binary: Path, tmp_path: Path, arguments: str, nodes: int
) -> None:
    """So many nodes has the strategy of the published file of this size."""
    file = tmp_path / "family.structuredslugs"
    with file.open("w") as out:
        subprocess.run([sys.executable, FAMILIES, *arguments.split()], stdout=out, check=True)
    listed = subprocess.run(
        [slugs_binary, "--explicitStrategy", file], capture_output=True, text=True, check=True
    ).stdout
    assert listed.count("State ") == nodes


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("arbiter --clients 1", "1 is not in the range"),
        ("grid --rows 3 --cols 3 --goals 9", "9 goals on a border of 8 cells"),
    ],
)
def test_sizes_are_checked(arguments: str, message: str) -> None:
    refused = subprocess.run(
        [sys.executable, FAMILIES, *arguments.split()], capture_output=True, text=True, check=False
    )
    assert refused.returncode == 2
    assert message in refused.stderr
