"""Published specifications with known verdicts and strategies (`expected.csv` of the corpus).

The verdict of every row; where upstream's strategy is known, its bytes; every other strategy and
counterstrategy that is small enough to store holds up before `safenav verify`.
"""

import csv
import hashlib
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from once import CORPUS
from slugs.commands import failure

STRATEGY = ("--explicitStrategy", "--jsonOutput")
COUNTERSTRATEGY = ("--counterStrategy", "--jsonOutput")
TIMEOUT = 300
SLOW = (
    "basicEvasion",
    "Belief_Evasion",
    "coop_0",
    "bunny_many_goals_8",
    "bunny_many_goals_20",
    "genbuf_20",
    "genbuf_40",
    "genbuf_60",
    "jcss12_6",
    "jcss12_8",
    "synt15_24",
    "synt15_25",
    "synt15_28",
    "synt15_30",
)
# Their strategies have hundreds of megabytes and more: only the verdict is requested.
HUGE = ("genbuf_10", "synt15_5", "synt15_10", *SLOW[4:])
VERIFIED = {
    "slugs/basicEvasion.structuredslugs": "7b8c38a3b09eaf9e",
    "gr1/synt15_2.slugsin": "2d9eb466675c7126",
    "gr1/jcss12_2.slugsin": "f017d67aece01216",
}
"""How the sha256 of strategies begin that upstream did not finish, and that `safenav verify` has
accepted in 20 s: another one of such a file is verified again."""


@dataclass(frozen=True)
class Row:
    """One line of expected.csv; no nodes or sha256: upstream did not finish the strategy."""

    file: str
    verdict: str
    nodes: int | None
    sha256: str | None


def _rows() -> Iterator[Row]:
    table = CORPUS / "expected.csv"
    if table.is_file():
        with table.open() as lines:
            for row in csv.DictReader(lines):
                nodes = int(row["strategy_nodes"]) if row["strategy_nodes"] else None
                yield Row(row["file"], row["verdict"], nodes, row["strategy_sha256"] or None)


ROWS = list(_rows())
if not ROWS:
    reason = f"no expected.csv at {CORPUS}; set SAFENAV_CORPUS to the corpus"
    pytest.skip(reason, allow_module_level=True)


def _parameters(rows: list[Row]) -> list[object]:
    return [
        pytest.param(
            row,
            id=row.file,
            marks=[pytest.mark.slow] if any(name in row.file for name in SLOW) else [],
        )
        for row in rows
    ]


def _is_huge(row: Row) -> bool:
    return any(name in row.file for name in HUGE)


def _ask(binary: Path, output: Path, *arguments: str) -> tuple[str | None, str]:
    """Run slugs on a corpus file; the verdict of its RESULT line, and its messages."""
    with output.open("wb") as out:
        process = subprocess.run(
            [binary, *arguments], stdout=out, stderr=subprocess.PIPE, timeout=TIMEOUT, check=False
        )
    messages = process.stderr.decode()
    for verdict in ("unrealizable", "realizable"):
        if f"RESULT: Specification is {verdict}." in messages:
            return verdict, messages
    return None, messages


def _sha256(path: Path) -> str:
    with path.open("rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()


@pytest.mark.parametrize("row", _parameters([row for row in ROWS if row.verdict == "realizable"]))
def test_published_strategies_are_reproduced_to_the_byte(
    slugs_binary: Path, tmp_path: Path, row: Row
) -> None:
    """The verdict, the bytes of the strategy where they are known, and else its soundness."""
    file, strategy = str(CORPUS / row.file), tmp_path / "strategy.json"
    huge = _is_huge(row)
    verdict, messages = _ask(slugs_binary, strategy, *(() if huge else STRATEGY), file)
    assert verdict == "realizable", messages
    if huge:
        assert strategy.read_bytes() == b""
        return
    with strategy.open("rb") as lines:
        nodes = sum(line.startswith(b'\t"rank"') for line in lines)
    assert nodes == (row.nodes or nodes)
    if row.sha256 is not None:
        assert _sha256(strategy) == row.sha256
    accepted = row.sha256 or VERIFIED.get(row.file, "-")
    if nodes < 500 or not _sha256(strategy).startswith(accepted):
        assert failure(Path(file), strategy) is None


@pytest.mark.parametrize("row", _parameters([row for row in ROWS if row.verdict == "unrealizable"]))
def test_counterstrategies_of_published_files_are_sound(
    slugs_binary: Path, tmp_path: Path, row: Row
) -> None:
    """The verdict, no strategy, and a counterstrategy that holds up."""
    file, counterstrategy = str(CORPUS / row.file), tmp_path / "counterstrategy.json"
    verdict, messages = _ask(slugs_binary, counterstrategy, *STRATEGY, file)
    assert verdict == "unrealizable", messages
    assert counterstrategy.read_bytes() == b""
    verdict, messages = _ask(slugs_binary, counterstrategy, *COUNTERSTRATEGY, file)
    assert verdict == "unrealizable", messages
    assert failure(Path(file), counterstrategy, counter=True) is None


def _is_quick(row: Row) -> bool:
    return not any(name in row.file for name in SLOW)


@pytest.mark.parametrize("row", _parameters([row for row in ROWS if row.sha256 and _is_quick(row)]))
def test_translation_keeps_the_strategy(slugs_binary: Path, tmp_path: Path, row: Row) -> None:
    """What --translate prints is played exactly like the file itself."""
    translated, strategy = tmp_path / "translated.slugsin", tmp_path / "strategy.json"
    _ask(slugs_binary, translated, "--translate", str(CORPUS / row.file))
    verdict, messages = _ask(slugs_binary, strategy, *STRATEGY, str(translated))
    assert verdict == "realizable", messages
    assert _sha256(strategy) == row.sha256
