"""A batch keeps its results, retries only on request, and stops when it must."""

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from safenav.batch.cases.case import Case, CaseVerdict, Result, without_a_run
from safenav.batch.journal import StateFile
from safenav.batch.session import Arrival, Report, run_batch
from safenav.errors import UsageError

CASES = tuple(Case(f"{letter}.yaml", f"{letter}.yaml", letter) for letter in "abcd")

Script = Callable[[Case, int], CaseVerdict]


class Scripted:
    """A backend that answers one case at a time as a function of the case and the attempt."""

    def __init__(self, script: Script, traces: Path | None = None) -> None:
        self._script = script
        self._traces = traces
        self._todo: deque[Case] = deque()
        self.asked: list[str] = []
        self.closed = False

    def submit(self, case: Case) -> None:
        self._todo.append(case)

    def collect(self, seconds: float) -> list[Arrival]:
        assert seconds > 0
        case = self._todo.popleft()
        self.asked.append(case.name)
        verdict = self._script(case, self.asked.count(case.name))
        reasons = [] if verdict is CaseVerdict.PASSED else [f"reason {len(self.asked)}"]
        trace = None
        if self._traces is not None:
            trace = self._traces / f"{len(self.asked)}.jsonl"
            trace.write_text(case.name)
        return [Arrival(case, without_a_run(case, verdict, reasons), trace)]

    def running(self) -> list[tuple[str, float]]:
        return []

    def close(self) -> None:
        self.closed = True


def passing(case: Case, attempt: int) -> CaseVerdict:
    del case, attempt
    return CaseVerdict.PASSED


def failing(*letters: str, until: int = 99) -> Script:
    def script(case: Case, attempt: int) -> CaseVerdict:
        bad = case.name[0] in letters and attempt < until
        return CaseVerdict.DIFFERENT if bad else CaseVerdict.PASSED

    return script


def test_a_case_that_passes_after_a_retry_is_flaky_and_keeps_its_reasons() -> None:
    report = run_batch(CASES, Scripted(failing("b", until=3)), retries=2)
    assert report.as_expected
    result = report.results["b.yaml"]
    assert result.flaky
    assert (result.attempts, result.earlier) == (3, ["reason 2", "reason 5"])
    assert not report.results["a.yaml"].flaky


def test_a_file_that_is_not_a_scenario_is_not_retried() -> None:
    backend = Scripted(
        lambda case, _: CaseVerdict.INVALID if case is CASES[0] else CaseVerdict.PASSED
    )
    run_batch(CASES, backend, retries=5)
    assert backend.asked.count("a.yaml") == 1


@pytest.mark.parametrize("cut", [1, 40, 200])
def test_a_line_that_was_cut_off_costs_one_case(tmp_path: Path, cut: int) -> None:
    with StateFile(tmp_path, resume=False) as state:
        run_batch(CASES, Scripted(passing), state=state)
    path = tmp_path / "state.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole[: -1 - cut])
    backend = Scripted(passing)
    with StateFile(tmp_path, resume=True) as state:
        run_batch(CASES, backend, state=state)
    assert backend.asked == ["d.yaml"]
    with StateFile(tmp_path, resume=True) as state:
        assert len(state.former) == 4


def test_results_are_on_disk_when_they_arrive(tmp_path: Path) -> None:
    lines: list[int] = []

    class Watching:
        def waiting(self, report: Report, running: Sequence[tuple[str, float]]) -> None:
            del report, running

        def arrived(self, report: Report, result: Result) -> None:
            del report, result
            lines.append(len((tmp_path / "state.jsonl").read_text().splitlines()))

    with StateFile(tmp_path, resume=False) as state:
        run_batch(CASES, Scripted(passing), state=state, observer=Watching())
    assert lines == [1, 2, 3, 4]


def test_two_batches_do_not_share_a_state_file(tmp_path: Path) -> None:
    with (
        StateFile(tmp_path, resume=False),
        pytest.raises(UsageError, match="another batch is writing"),
    ):
        StateFile(tmp_path, resume=True)
    StateFile(tmp_path, resume=True).__exit__(None, None, None)


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write the state"):
        StateFile(tmp_path / "file", resume=False)
