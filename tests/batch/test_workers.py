"""Parts of a batch: its processes, its table, and the files that its bundles hold."""

import os
import re
import signal
from pathlib import Path

import pytest

from batch.conftest import SlugsLog, scenario
from once import ROOT
from safenav import SafenavError
from safenav.batch.case import Case, CaseVerdict, Conditions, Result
from safenav.batch.session import Report
from safenav.batch.worker import Worker, leave, run_case
from safenav.certify.check import sources_of
from safenav.report.batch import summary

QUICK = Case("quick.yaml", "quick.yaml", scenario())


def test_no_case_begins_in_a_batch_that_has_ended(slugs: SlugsLog) -> None:
    """A thread that has already taken a case starts no process for it."""
    leave("interrupted")
    with pytest.raises(SafenavError, match="the batch has ended"):
        run_case("interrupted", QUICK, Conditions())
    assert not slugs.pids


def test_an_unresponsive_worker_is_killed(tmp_path: Path) -> None:
    worker = Worker()
    assert worker.run(QUICK, Conditions(), tmp_path / "trace.jsonl").passed
    os.kill(worker.pid, signal.SIGSTOP)
    worker.end()
    assert not worker.alive


def test_the_table_lists_failed_cases_first_then_slow_ones() -> None:
    """Names and reasons give no orders to the terminal: a file may have any name, and a reason may
    quote what a process has written."""

    def ended(name: str, seconds: float, verdict: CaseVerdict = CaseVerdict.PASSED) -> Result:
        reasons = [] if verdict is CaseVerdict.PASSED else ["killed by \x1b[2J"]
        return Result(name, name, {}, "", verdict, reasons, seconds=seconds)

    results = [ended(f"{number}.yaml", number / 10) for number in range(12)]
    results += [ended("a/\x1b[2J.yaml", 0, CaseVerdict.CRASHED), ended("slow.yaml", 3)]
    cases = tuple(Case(result.name, result.file) for result in results)
    lines = summary(Report(cases, {result.name: result for result in results}, seconds=7.5))
    text = re.sub("\x1b\\[[0-9]*m", "", "\n".join(lines))
    shown = [line.split()[0] for line in text.splitlines()[2:6]]
    assert shown == ["a/?[2J.yaml", "slow.yaml", "11.yaml", "10.yaml"]
    assert "\n... and 3 more passed\n" in text
    assert "\na/?[2J.yaml: crashed\n  killed by ?[2J\n" in text
    assert text.endswith("13 passed, 1 crashed in 7.5 s") and "\x1b" not in text


@pytest.mark.parametrize(
    ("named", "files"),
    [
        ("{grid: ['#####', '#...#', '#####']}", []),
        ("{image: floor.pgm, rows: 1, cols: 1}", ["floor.pgm"]),
        ("{ros: maps/floor.yaml, resolution: 0.5}", ["maps/floor.yaml", "maps/floor.pgm"]),
        ("{movingai: arena.map}", ["arena.map"]),
    ],
    ids=["drawn", "image", "ros", "movingai"],
)
def test_a_bundle_holds_the_scenario_and_each_file_that_it_names(
    named: str, files: list[str], tmp_path: Path
) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps/floor.yaml").write_text("resolution: 0.5\nimage: floor.pgm\n")
    for name in ("floor.pgm", "maps/floor.pgm", "arena.map", "own.yaml", "unrelated.png"):
        (tmp_path / name).write_text("first")
    text = f"map: {named}\ncatalogue: own.yaml\n"
    held = sources_of(tmp_path / "lab.yaml", text)
    assert (held.keys(), held["lab.yaml"]) == ({"lab.yaml", "own.yaml", *files}, text.encode())


def test_the_documentation_names_every_verdict() -> None:
    page = (ROOT / "docs/batch.md").read_text(encoding="utf-8")
    assert [v for v in CaseVerdict if f"| `{v.value}` |" not in page] == []
