"""One batch: assignment of cases, results, retries and the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from msgspec import Struct
from msgspec.structs import replace

from safenav.batch.cases.case import Case, Result
from safenav.batch.journal import StateFile


class Arrival(Struct, frozen=True):
    """A result, and the file of its trace until it is kept or discarded."""

    case: Case
    result: Result
    trace: Path | None = None


class Backend(Protocol):
    """Runs cases; each gives a result, even if it crashes or hangs."""

    def submit(self, case: Case) -> None:
        """Queue a case; return immediately."""

    def collect(self, seconds: float) -> list[Arrival]:
        """Return the results that have arrived, waiting at most ``seconds`` for the first.

        Raises SafenavError if no more cases can be run at all.
        """

    def running(self) -> list[tuple[str, float]]:
        """Return the names of running cases, as far as known, with their seconds so far."""

    def close(self) -> None:
        """Stop all work, leaving no process behind."""


Artifacts = Callable[[Result, Path | None], list[str]]
"""Writes files that help to analyse a failed case, given its trace, if any; returns their names."""

_LOOK_SECONDS = 0.2


class Observer(Protocol):
    """Receives the progress of a batch."""

    def waiting(self, report: Report, running: Sequence[tuple[str, float]]) -> None:
        """Called several times per second: running cases with their seconds so far."""

    def arrived(self, report: Report, result: Result) -> None:
        """Record the last result of a case."""


class Report(Struct):
    """The results of a batch. ``results``: by name, in the order of arrival; ``resumed``: number of
    results from before. ``interrupted``: it was stopped; ``stopped_early``: by the first
    failure."""

    cases: tuple[Case, ...]
    results: dict[str, Result]
    resumed: int = 0
    seconds: float = 0.0
    interrupted: bool = False
    stopped_early: bool = False

    @property
    def in_order(self) -> list[Result]:
        """Results in the order of the cases."""
        return [self.results[case.name] for case in self.cases if case.name in self.results]

    @property
    def failed(self) -> list[Result]:
        return [result for result in self.in_order if not result.passed]

    @property
    def not_run(self) -> list[Case]:
        return [case for case in self.cases if case.name not in self.results]

    @property
    def left(self) -> int:
        """Number of cases without a result."""
        return len(self.cases) - len(self.results)

    @property
    def as_expected(self) -> bool:
        """Whether every case has passed."""
        return not self.left and not self.failed


def run_batch(
    cases: Sequence[Case],
    backend: Backend,
    *,
    state: StateFile | None = None,
    retries: int = 0,
    fail_fast: bool = False,
    artifacts: Artifacts | None = None,
    observer: Observer | None = None,
) -> Report:
    """Run all cases without a result in ``state``, and close the backend.

    KeyboardInterrupt ends the batch, which the report then says (``interrupted``). Raises
    SafenavError if no case can be run any longer; results so far are in the state file.
    """
    former = {} if state is None else state.former
    done = {case.name: former[case.fingerprint] for case in cases if case.fingerprint in former}
    report = Report(tuple(cases), done, resumed=len(done))
    earlier: dict[str, list[str]] = {}

    def take(arrival: Arrival) -> None:
        case, before = arrival.case, earlier.pop(arrival.case.name, [])
        result = replace(arrival.result, attempts=len(before) + 1, earlier=before)
        again = result.worth_another_try and result.attempts <= retries and not result.passed
        if not (again or result.passed or artifacts is None):
            result = replace(result, artifacts=artifacts(result, arrival.trace))
        if arrival.trace is not None:
            arrival.trace.unlink(missing_ok=True)
        if again:
            earlier[case.name] = [*before, "; ".join(result.reasons)]
            backend.submit(case)
            return
        if state is not None:
            state.add(result)
        report.results[case.name] = result
        report.stopped_early |= fail_fast and not result.passed and report.left > 0
        if observer is not None:
            observer.arrived(report, result)

    begun = time.monotonic()
    try:
        for case in report.not_run:
            backend.submit(case)
        while report.left and not report.stopped_early:
            for arrival in backend.collect(_LOOK_SECONDS):
                take(arrival)
            report.seconds = time.monotonic() - begun
            if observer is not None:
                observer.waiting(report, backend.running())
    except KeyboardInterrupt:
        report.interrupted = True
    finally:
        backend.close()
    return report
