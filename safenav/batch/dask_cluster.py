"""Cases on a Dask cluster: ``--dask ADDRESS`` (optional extra ``safenav[dask]``).

A Dask worker runs each case in a process of its own, kept for the next case: one that crashes or
hangs costs neither the Dask worker nor the cases beside it. If a Dask worker dies, the scheduler
gives its cases to another one, also those whose results had not been fetched yet. Running a case
twice does no harm.
"""

from __future__ import annotations

import contextlib
import importlib
import queue
import tempfile
import threading
import time
import uuid
from collections import defaultdict
from pathlib import Path
from typing import Any

from msgspec import Struct, convert, to_builtins
from msgspec.structs import replace

import safenav
from safenav.batch.cases.case import Case, CaseVerdict, Conditions, Result, without_a_run
from safenav.batch.session import Arrival
from safenav.batch.workers.worker import Worker
from safenav.errors import SafenavError, UsageError
from safenav.extras import missing

_lock = threading.Lock()
_idle: dict[str, list[Worker]] = defaultdict(list)
_busy: dict[str, set[Worker]] = defaultdict(set)
"""Worker processes on this machine by batch, since several batches may share a cluster."""


def version_here() -> str:
    return safenav.__version__


def run_case(
    batch: str, directory: str, case: dict[str, Any], conditions: dict[str, Any], traced: bool
) -> tuple[dict[str, Any], bytes]:
    """Return the result of a case as a record, and its trace if that is wanted and the case failed.
    ``directory``: the batch's own, to which paths in the scenario are relative.

    Raises SafenavError if no worker process can be started here.
    """
    with _lock:
        worker = _idle[batch].pop() if _idle[batch] else Worker()
        _busy[batch].add(worker)
    try:
        with tempfile.TemporaryDirectory(prefix="safenav-") as folder:
            trace = Path(folder) / "trace.jsonl" if traced else None
            worker.give(Case(**case), Conditions(**conditions), trace, directory)
            result = worker.wait()
            content = b""
            if trace is not None and not result.passed and trace.exists():
                content = trace.read_bytes()
    except BaseException:
        worker.end()
        raise
    finally:
        with _lock:
            _busy[batch].discard(worker)
            if worker.alive:
                _idle[batch].append(worker)
    return result.record(), content


def leave(batch: str) -> None:
    """End all worker processes of a batch that has ended."""
    with _lock:
        for worker in _idle.pop(batch, []):
            worker.end()
        for worker in _busy.pop(batch, set()):
            worker.kill()  # the thread that waits for it cleans up


_CONNECT_SECONDS = 10


class _Sent(Struct):
    case: Case
    since: float


class DaskCluster:
    """Cases on the cluster at ``address``. ``traces``: where to write traces, if anywhere.

    Raises UsageError if ``distributed`` is not installed, nothing answers at the address, or
    a worker there has no safenav of this version.
    """

    def __init__(self, address: str, conditions: Conditions, traces: Path | None = None) -> None:
        dask = _distributed()
        self._address = address
        self._conditions = conditions
        self._traces = traces
        self._batch = uuid.uuid4().hex
        self._sent: dict[Any, _Sent] = {}
        self._news: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._traces_written = 0
        try:
            self._client = dask.Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise UsageError(f"no Dask cluster answers at {address}: {error}") from error
        try:
            self._check_versions()
        except SafenavError:
            self._client.close()
            raise

    def submit(self, case: Case) -> None:
        future = self._client.submit(
            run_case,
            self._batch,
            str(Path.cwd()),
            to_builtins(case),
            to_builtins(self._conditions),
            self._traces is not None,
            pure=False,
        )
        self._sent[future] = _Sent(case, time.monotonic())
        future.add_done_callback(self._news.put)

    def collect(self, seconds: float) -> list[Arrival]:
        """Return the results that have arrived, waiting at most ``seconds`` for the first."""
        futures: list[Any] = []
        with contextlib.suppress(queue.Empty):
            futures.append(self._news.get(timeout=seconds))
            while True:
                futures.append(self._news.get_nowait())
        return [self._arrival(future) for future in futures]

    def running(self) -> list[tuple[str, float]]:
        """Return an empty list: querying the cluster would cost more than the answer is worth."""
        return []

    def close(self) -> None:
        if self._client.status == "closed":
            return
        with contextlib.suppress(Exception):  # the cluster may be gone: nothing is left to stop
            self._client.cancel(list(self._sent), force=True)
            self._client.run(leave, self._batch)
        self._sent.clear()
        self._client.close()

    def _arrival(self, future: Any) -> Arrival:
        sent = self._sent.pop(future)
        case, content = sent.case, b""
        try:
            record, content = future.result()
            result = convert(record, Result)
        except SafenavError as error:
            result = without_a_run(case, CaseVerdict.ERROR, [str(error)])
        except Exception as error:
            result = self._failed(case, future, error)
        if not result.wall_seconds:
            result = replace(result, wall_seconds=round(time.monotonic() - sent.since, 6))
        return Arrival(case, result, self._kept(content))

    def _failed(self, case: Case, future: Any, error: Exception) -> Result:
        """Return the result of a case that failed on the cluster. Raises SafenavError if the
        cluster is gone."""
        if future.status in ("cancelled", "lost"):
            raise SafenavError(
                f"the Dask cluster at {self._address} is gone: {error}\n"
                "    with --out the results so far are kept; continue with --resume"
            ) from error
        kind = type(error).__name__
        if kind == "KilledWorker":
            reason = f"the Dask workers that ran it died, one after the other: {error}"
            return without_a_run(case, CaseVerdict.CRASHED, [reason])
        return without_a_run(case, CaseVerdict.ERROR, [f"on the cluster: {kind}: {error}"])

    def _kept(self, content: bytes) -> Path | None:
        if not content or self._traces is None:
            return None
        self._traces_written += 1
        path = self._traces / f"{self._traces_written}.jsonl"
        path.write_bytes(content)
        return path

    def _check_versions(self) -> None:
        """Compare safenav's version on the workers connected now, if any. Raises UsageError."""
        try:
            versions = self._client.run(version_here)
        except Exception as error:
            raise UsageError(
                f"the Dask workers at {self._address} cannot run safenav: {error}\n"
                f"    install safenav {safenav.__version__} where they run"
            ) from error
        for worker, version in versions.items():
            if version != safenav.__version__:
                raise UsageError(
                    f"the Dask worker {worker} has safenav {version}, this is "
                    f"{safenav.__version__}\n    install the same version on both"
                )


def _distributed() -> Any:
    """Return the package, imported only here: it is large, and optional. Raises UsageError."""
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise missing("a Dask cluster", "distributed", "dask") from error
