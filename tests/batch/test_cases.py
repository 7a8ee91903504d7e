"""Processes of a batch, and its results on the disk."""

import os
import signal
from pathlib import Path

import pytest

from batch.made_scenarios import SlugsLog, Write, scenario
from batch.running import safenav, started, wait_until
from safenav.batch.case import Case, Conditions
from safenav.batch.pool import Pool
from safenav.batch.session import ResultsFile, run_batch
from safenav.batch.worker import Worker
from safenav.errors import SafenavError, UsageError
from synthesis.requests import gone

QUICK = Case("quick.yaml", "quick.yaml", scenario())


@pytest.mark.usefixtures("slugs")
def test_a_process_that_does_not_react_is_killed(tmp_path: Path) -> None:
    worker = Worker()
    assert worker.run(QUICK, Conditions(), tmp_path / "trace.jsonl").passed
    os.kill(worker.pid, signal.SIGSTOP)
    worker.end()
    assert not worker.alive


def test_an_environment_in_which_no_worker_starts_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "yaml.py").write_text("raise RuntimeError('no yaml here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(SafenavError, match=r"(?s)does not start.*no yaml here"):
        run_batch([QUICK], Pool(1, Conditions()))


def test_workers_end_when_the_batch_is_killed(slugs: SlugsLog, write: Write) -> None:
    write("a.yaml", "sleeper")
    with started("a.yaml") as batch:
        wait_until(batch, lambda: bool(slugs.pids))
        stat = Path(f"/proc/{slugs.pids[0]}/stat").read_text()
        batch.send_signal(signal.SIGKILL)
    assert gone(int(stat.rpartition(")")[2].split()[1]))
    assert slugs.all_gone()


@pytest.mark.parametrize("cut", [1, 200])
def test_a_line_that_was_cut_off_costs_one_case(write: Write, slugs: SlugsLog, cut: int) -> None:
    for letter in "abc":
        write(f"{letter}.yaml")
    safenav(".", "--out", "out")
    results = Path("out/results.jsonl")
    results.write_bytes(results.read_bytes()[: -1 - cut])
    assert "(2 of them done before)" in safenav(".", "--out", "out", "--resume").stdout
    assert len(slugs.pids) == 4
    assert len(results.read_text().splitlines()) == 3


def test_two_batches_do_not_share_a_folder(tmp_path: Path) -> None:
    with (
        ResultsFile(tmp_path, resume=False),
        pytest.raises(UsageError, match="another batch is writing"),
    ):
        ResultsFile(tmp_path, resume=True)
    ResultsFile(tmp_path, resume=True).__exit__(None, None, None)
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write the results"):
        ResultsFile(tmp_path / "file", resume=False)
