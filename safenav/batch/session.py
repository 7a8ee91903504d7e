"""Execution of a batch: processes run its cases, and a file keeps their results.

The file of results has one line per case, written on arrival. So it has all results so far, however
a batch ends, and ``--resume`` continues from them. A result is reused only for an equal case (by
its fingerprint). Only one batch at a time may use the folder.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import IO

from msgspec import Struct, convert, to_builtins
from msgspec.structs import replace

from safenav.batch.case import Case, Result
from safenav.batch.pool import Pool
from safenav.batch.worker import running
from safenav.errors import UsageError
from safenav.files import json_line

NAME = "results.jsonl"


class ResultsFile:
    """The file ``directory/results.jsonl``. With ``resume``, ``former`` has its results by
    fingerprint. Otherwise they are discarded, and must all be results of ``cases`` (names).

    Raises UsageError if the directory cannot be used, is in use by another batch, or contains
    another batch's results.
    """

    def __init__(self, directory: Path, *, resume: bool, cases: Collection[str] = ()) -> None:
        self.path = directory / NAME
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._file: IO[str] = self.path.open("a+", encoding="utf-8")
        except OSError as error:
            raise self._unusable(error) from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise UsageError(
                f"another batch is writing to {directory}\n    wait for it, or use another --out"
            ) from None
        found = self._read()
        others = sorted(result.name for result in found.values() if result.name not in {*cases})
        if others and not resume:
            self._file.close()
            count = f" and {len(others) - 1} more" if len(others) > 1 else ""
            raise UsageError(
                f"{directory} holds results of another batch: {others[0]}{count}\n"
                "    use another --out, or remove this folder; --resume adds to its results"
            )
        self.former = found if resume else {}
        self._file.truncate(0)  # in place, since this file is locked
        for result in self.former.values():
            self.add(result)
        os.fsync(self._file.fileno())

    def add(self, result: Result) -> None:
        """Append a result. It then survives the end of this process."""
        try:
            self._file.write(json_line(to_builtins(result)))
            self._file.flush()
        except OSError as error:
            raise self._unusable(error) from error

    def _read(self) -> dict[str, Result]:
        """Return the results in the file by fingerprint. Ignore an incomplete line, so that its
        case runs again."""
        found = {}
        self._file.seek(0)
        for line in self._file:
            try:
                result = convert(json.loads(line), Result)
            except ValueError:
                continue
            found[result.fingerprint] = result
        return found

    def _unusable(self, error: OSError) -> UsageError:
        return UsageError(f"cannot write the results of the batch, {self.path}: {error.strerror}")

    def __enter__(self) -> ResultsFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


_LOOK_SECONDS = 0.2

Artifacts = Callable[[Result, bytes], list[str]]
"""A function that writes files for the analysis of a failed case, and returns their names."""
Progress = Callable[["Report", "Result | None"], None]
"""A listener, called several times per second and with each result on arrival."""


class Report(Struct):
    """The results of a batch by case name, in the order of arrival. ``resumed``: the number of
    results of earlier calls; ``interrupted``: whether the batch was stopped; ``running``: name and
    seconds so far of each running case, as far as known."""

    cases: tuple[Case, ...]
    results: dict[str, Result]
    resumed: int = 0
    seconds: float = 0.0
    interrupted: bool = False
    running: Sequence[tuple[str, float]] = ()

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
        """Whether every case of the batch has passed."""
        return not self.left and not self.failed


def run_batch(
    cases: Sequence[Case],
    pool: Pool,
    *,
    kept: ResultsFile | None = None,
    artifacts: Artifacts | None = None,
    progress: Progress | None = None,
) -> Report:
    """Run all cases without a result in ``kept``, and close the pool.

    KeyboardInterrupt ends the batch; the report records this (``interrupted``). Raises SafenavError
    if no further case can run; results so far are in ``kept``.
    """
    former = {} if kept is None else kept.former
    done = {case.name: former[case.fingerprint] for case in cases if case.fingerprint in former}
    report = Report(tuple(cases), done, resumed=len(done))
    begun = time.monotonic()
    try:
        for case in report.not_run:
            pool.submit(case)
        while report.left:
            for case, result, trace in pool.collect(_LOOK_SECONDS):
                if not result.passed and artifacts is not None:
                    result = replace(result, artifacts=artifacts(result, trace))
                if kept is not None:
                    kept.add(result)
                report.results[case.name] = result
                if progress is not None:
                    progress(report, result)
            report.seconds, report.running = time.monotonic() - begun, running(pool.batch)
            if progress is not None:
                progress(report, None)
    except KeyboardInterrupt:
        report.interrupted = True
    finally:
        pool.close()
    return report
