"""Published specifications with known verdicts and strategies (`expected.csv` of the corpus).

The verdict of every row; where upstream's strategy is known, its bytes; every other strategy and
counterstrategy that is small enough to store holds up before `safenav verify`.
"""

import csv
import hashlib
import subprocess
from pathlib import Path
from typing import Any

import pytest

from once import CORPUS, beside, from_yaml
from oracle.duel import verdict
from slugs.conftest import STRATEGY, failure

KNOWN = from_yaml(beside(__file__, "corpus.yaml"))
TABLE = CORPUS / "expected.csv"
if not TABLE.is_file():
    reason = f"no expected.csv at {CORPUS}; set SAFENAV_CORPUS to the corpus"
    pytest.skip(reason, allow_module_level=True)
with TABLE.open() as _lines:
    ROWS = [*csv.DictReader(_lines)]
"""Without a sha256, upstream did not finish the strategy."""


def _is(kind: str, row: dict[str, str]) -> bool:
    return any(name in row["file"] for name in KNOWN[kind])


def _rows(rows: list[dict[str, str]]) -> Any:
    slow = [pytest.mark.slow]
    parameters = [pytest.param(r, id=r["file"], marks=slow * _is("slow", r)) for r in rows]
    return pytest.mark.parametrize("row", parameters)


def _ask(binary: Path, output: Path, *arguments: str | Path) -> str | None:
    """Run slugs on a corpus file; the verdict of its RESULT line."""
    with output.open("wb") as out:
        command, pipe = [binary, *arguments], subprocess.PIPE
        done = subprocess.run(command, stdout=out, stderr=pipe, timeout=300, check=False)
    return verdict(done.stderr.decode())


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@_rows([row for row in ROWS if row["verdict"] == "realizable"])
def test_published_strategies_are_reproduced_to_the_byte(
    slugs_binary: Path, tmp_path: Path, row: dict[str, str]
) -> None:
    """The verdict, the bytes of the strategy where they are known, and else its soundness."""
    file, strategy, huge = CORPUS / row["file"], tmp_path / "strategy.json", _is("huge", row)
    assert _ask(slugs_binary, strategy, *(() if huge else STRATEGY), file) == "realizable"
    if huge:
        assert strategy.read_bytes() == b""
        return
    nodes = strategy.read_bytes().count(b'\t"rank"')
    assert nodes == int(row["strategy_nodes"] or nodes)
    printed = _sha256(strategy)
    assert printed == (row["strategy_sha256"] or printed)
    accepted = row["strategy_sha256"] or KNOWN["verified"].get(row["file"], "-")
    if nodes < 500 or not printed.startswith(accepted):
        assert failure(file, strategy) is None


@_rows([row for row in ROWS if row["verdict"] == "unrealizable"])
def test_counterstrategies_of_published_files_are_sound(
    slugs_binary: Path, tmp_path: Path, row: dict[str, str]
) -> None:
    """The verdict, no strategy, and a counterstrategy that holds up."""
    file, printed = CORPUS / row["file"], tmp_path / "counterstrategy.json"
    assert _ask(slugs_binary, printed, *STRATEGY, file) == "unrealizable"
    assert printed.read_bytes() == b""
    options = ("--counterStrategy", "--jsonOutput")
    assert _ask(slugs_binary, printed, *options, file) == "unrealizable"
    assert failure(file, printed, counter=True) is None


@_rows([row for row in ROWS if row["strategy_sha256"] and not _is("slow", row)])
def test_the_translation_keeps_the_strategy(
    slugs_binary: Path, tmp_path: Path, row: dict[str, str]
) -> None:
    """What --translate prints is played exactly like the file itself."""
    translated, strategy = tmp_path / "translated.slugsin", tmp_path / "strategy.json"
    _ask(slugs_binary, translated, "--translate", CORPUS / row["file"])
    assert _ask(slugs_binary, strategy, *STRATEGY, translated) == "realizable"
    assert _sha256(strategy) == row["strategy_sha256"]
