"""Cases run in separate processes: one that crashes or hangs does not affect the others."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from batch.made_scenarios import SlugsLog, Write, scenario
from safenav.batch.cases.case import Case, CaseVerdict, Conditions
from safenav.batch.session import Arrival
from safenav.batch.workers import worker as workers
from safenav.batch.workers.pool import LocalPool
from safenav.batch.workers.worker import Worker
from safenav.errors import SafenavError

pytestmark = pytest.mark.usefixtures("slugs")


def case(robot: str, number: int = 0, text: str | None = None) -> Case:
    name = f"{robot}-{number}.yaml"
    return Case(name, name, scenario(robot) if text is None else text, {"seed": number})


def run(
    cases: list[Case], jobs: int = 2, seconds: float = 20.0, traces: Path | None = None
) -> dict[str, Arrival]:
    pool = LocalPool(jobs, Conditions(seconds), traces)
    try:
        for one in cases:
            pool.submit(one)
        arrived: list[Arrival] = []
        while len(arrived) < len(cases):
            arrived += pool.collect(0.2)
    finally:
        pool.close()
    return {arrival.case.name: arrival for arrival in arrived}


def verdicts(arrived: dict[str, Arrival]) -> dict[str, CaseVerdict]:
    return {name: arrival.result.verdict for name, arrival in arrived.items()}


def test_a_crash_is_reported_and_the_other_cases_run() -> None:
    arrived = run([case("quick"), case("crasher"), case("quick", 1), case("quick", 2)])
    crashed = arrived.pop("crasher-0.yaml").result
    assert set(verdicts(arrived).values()) == {CaseVerdict.PASSED}
    assert crashed.verdict is CaseVerdict.CRASHED
    assert crashed.reasons == ["the process that ran it died: killed by SIGSEGV"]
    assert "Segmentation fault" in crashed.detail
    assert "slugs.py" in crashed.detail  # the stack says where it was


def test_a_case_that_hangs_is_stopped_with_its_synthesizer(
    slugs: SlugsLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    def monotonic() -> float:
        """It advances only by 1.5 s when the sleeper's synthesizer begins, since on a busy machine
        the other cases take longer than the limit."""
        return 1e9 + 1.5 * bool(slugs.pids)

    clock = SimpleNamespace(**{**vars(time), "monotonic": monotonic})
    monkeypatch.setattr("safenav.batch.workers.worker.time", clock)
    arrived = run([case("sleeper"), case("quick"), case("quick", 1)], jobs=1, seconds=1.0)
    hung = arrived.pop("sleeper-0.yaml").result
    assert set(verdicts(arrived).values()) == {CaseVerdict.PASSED}
    assert hung.verdict is CaseVerdict.HUNG
    assert hung.reasons == ["stopped after 1 s (time limit)"]
    assert "slugs.py" in hung.detail
    assert hung.wall_seconds == 1.5
    assert slugs.all_gone()


def test_kinds_of_failure_are_distinguished() -> None:
    unexpected = scenario("other", "{outcome: completed}")
    arrived = run(
        [
            case("broken"),
            case("odd", text="safenav: 1\nmap: 3\n"),
            case("other", text=unexpected),
            Case("gone.yaml", "gone.yaml", None),
            case("astray"),
        ]
    )
    assert verdicts(arrived) == {
        "broken-0.yaml": CaseVerdict.ERROR,
        "odd-0.yaml": CaseVerdict.INVALID,
        "other-0.yaml": CaseVerdict.DIFFERENT,
        "gone.yaml": CaseVerdict.INVALID,
        "astray-0.yaml": CaseVerdict.PASSED,
    }
    reasons = {name: arrival.result.reasons for name, arrival in arrived.items()}
    assert reasons["other-0.yaml"] == ["outcome: expected completed, got unrealizable"]
    assert "odd-0.yaml:2:6: " in reasons["odd-0.yaml"][1]
    assert "gone.yaml: no such file" in reasons["gone.yaml"][0]
    assert "out of order" in reasons["broken-0.yaml"][0]


def test_a_worker_is_used_again_and_keeps_nothing_of_the_case_before() -> None:
    worker = Worker()
    try:
        for number, robot in enumerate(["quick", "broken", "quick"]):
            worker.give(case(robot, number), Conditions(), None)
            result = worker.wait()
            assert result.passed == (robot == "quick")
            assert result.name == f"{robot}-{number}.yaml"
            assert worker.alive
    finally:
        worker.end()


def test_an_environment_in_which_no_worker_starts_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "yaml.py").write_text("raise RuntimeError('no yaml here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(SafenavError, match=r"(?s)does not start.*no yaml here"):
        run([case("quick")])


ABANDONED = """
import sys, time
from batch.test_pool import case
from safenav.batch.cases.case import Conditions
from safenav.batch.workers import worker as workers
from safenav.batch.workers.worker import Worker
worker = Worker()
worker.give(case("sleeper"), Conditions(), None)
print(worker.pid, flush=True)
time.sleep(900)
"""


def test_workers_end_when_the_batch_is_killed(slugs: SlugsLog, write: Write) -> None:
    write("unused.yaml")
    tests = str(Path(__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([tests, *sys.path])}
    batch = subprocess.Popen(
        [sys.executable, "-c", ABANDONED],
        stdout=subprocess.PIPE,
        env=environment,
    )
    with batch:
        assert batch.stdout is not None
        worker = int(batch.stdout.readline())
        while not slugs.pids:
            time.sleep(0.02)
        batch.send_signal(signal.SIGKILL)
    slugs.path.write_text(f"{worker}\n{slugs.path.read_text()}")
    assert slugs.all_gone()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="marks are seen on Linux")
def test_a_process_that_is_about_to_begin_its_program_is_killed_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It has no environment for a moment, in which 8 of 1,500 escaped."""
    mark, real = "about to begin", workers._environment
    child = subprocess.Popen(["sleep", "900"], env={**os.environ, workers.MARK: mark})
    looks = iter([b"", b""])
    monkeypatch.setattr(
        workers,
        "_environment",
        lambda pid: next(looks, real(pid)) if pid == child.pid else real(pid),
    )
    workers.kill_orphans(mark)
    assert child.wait(timeout=60) == -signal.SIGKILL
