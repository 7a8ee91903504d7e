"""Cases run in separate processes, and their results are kept when they arrive."""

import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import pytest

from batch.made_scenarios import SlugsLog, Write, scenario
from safenav.batch.case import Case, CaseVerdict, Conditions, Result, without_a_run
from safenav.batch.results import ResultsFile
from safenav.batch.session import Pool, Report, run_batch
from safenav.batch.worker import Worker
from safenav.errors import SafenavError, UsageError


def case(robot: str, number: int = 0, text: str | None = None) -> Case:
    name = f"{robot}-{number}.yaml"
    return Case(name, name, scenario(robot) if text is None else text, {"seed": number})


@pytest.mark.usefixtures("slugs")
def test_a_worker_is_used_again_and_keeps_nothing_of_the_case_before() -> None:
    worker = Worker()
    for number, robot in enumerate(["quick", "broken", "quick"]):
        result = worker.run(case(robot, number), Conditions(), None)
        assert (result.passed, result.name) == (robot == "quick", f"{robot}-{number}.yaml")
        assert worker.alive
    worker.end()


@pytest.mark.usefixtures("slugs")
def test_a_process_that_does_not_react_is_killed() -> None:
    worker = Worker()
    assert worker.run(case("quick"), Conditions(), None).passed
    os.kill(worker.pid, signal.SIGSTOP)
    worker.end()
    assert not worker.alive


def test_an_environment_in_which_no_worker_starts_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "yaml.py").write_text("raise RuntimeError('no yaml here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(SafenavError, match=r"(?s)does not start.*no yaml here"):
        run_batch([case("quick")], Pool(1, Conditions()))


ABANDONED = """
from batch.test_cases import case
from safenav.batch.case import Conditions
from safenav.batch.worker import Worker
worker = Worker()
print(worker.pid, flush=True)
worker.run(case("sleeper"), Conditions(), None)
"""


def test_workers_end_when_the_batch_is_killed(slugs: SlugsLog, write: Write) -> None:
    write("unused.yaml")
    tests = str(Path(__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([tests, *sys.path])}
    batch = subprocess.Popen(
        [sys.executable, "-c", ABANDONED], stdout=subprocess.PIPE, env=environment
    )
    with batch:
        assert batch.stdout is not None
        worker = int(batch.stdout.readline())
        while not slugs.pids:
            time.sleep(0.02)
        batch.send_signal(signal.SIGKILL)
    slugs.path.write_text(f"{worker}\n{slugs.path.read_text()}")
    assert slugs.all_gone()


CASES = tuple(Case(f"{letter}.yaml", f"{letter}.yaml", letter) for letter in "abcd")


class Scripted(Pool):
    """A pool without processes, in which every case passes."""

    def __init__(self) -> None:
        self.asked = list[str]()
        self._todo = deque[Case]()

    def submit(self, case: Case) -> None:
        self._todo.append(case)

    def collect(self, seconds: float) -> list[tuple[Case, Result, bytes]]:
        assert seconds > 0
        case = self._todo.popleft()
        self.asked.append(case.name)
        return [(case, without_a_run(case, CaseVerdict.PASSED, []), b"")]

    def running(self) -> list[tuple[str, float]]:
        return []

    def close(self) -> None:
        self._todo.clear()


@pytest.mark.parametrize("cut", [1, 40, 200])
def test_a_line_that_was_cut_off_costs_one_case(tmp_path: Path, cut: int) -> None:
    lines: list[int] = []

    class Watching:
        def waiting(self, report: Report, running: Sequence[tuple[str, float]]) -> None:
            del report, running

        def arrived(self, report: Report, result: Result) -> None:
            del report, result
            lines.append(len(path.read_text().splitlines()))

    path = tmp_path / "results.jsonl"
    with ResultsFile(tmp_path, resume=False) as kept:
        run_batch(CASES, Scripted(), kept=kept, observer=Watching())
    assert lines == [1, 2, 3, 4], "each is on the disk when it arrives"
    path.write_bytes(path.read_bytes()[: -1 - cut])
    pool = Scripted()
    with ResultsFile(tmp_path, resume=True) as kept:
        run_batch(CASES, pool, kept=kept)
    assert pool.asked == ["d.yaml"]
    with ResultsFile(tmp_path, resume=True) as kept:
        assert len(kept.former) == 4


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
