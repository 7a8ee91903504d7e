"""Pools that run the cases of a batch: this machine or a Dask cluster (``--dask ADDRESS``, extra
``dask``).

If a Dask worker dies, the scheduler assigns its cases to another worker, also those with unfetched
results. A repeated case does no harm.
"""

import contextlib
import importlib
import os
import uuid
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

import safenav
from safenav.batch.case import Case, CaseVerdict, Conditions, Result
from safenav.batch.worker import leave, run_case
from safenav.errors import SafenavError, UsageError, needing

_CONNECT_SECONDS = 10


def processors() -> int:
    """Return the number of usable processors. Containers often have fewer than the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Pool:
    """A pool that runs at most ``jobs`` cases at a time, each in a process on this machine."""

    def __init__(self, jobs: int, conditions: Conditions) -> None:
        self.batch = uuid.uuid4().hex
        self.conditions = conditions
        self._threads = ThreadPoolExecutor(jobs)
        self._submit: Callable[..., Any] = self._threads.submit
        self._cases: dict[Any, Case] = {}
        self._done = SimpleQueue[Any]()

    def submit(self, case: Case) -> None:
        """Queue a case and return immediately."""
        future = self._submit(run_case, self.batch, case, self.conditions)
        self._cases[future] = case
        future.add_done_callback(self._done.put)

    def collect(self, seconds: float) -> list[tuple[Case, Result, bytes]]:
        """Return the ended cases with their results and traces. Wait at most ``seconds`` for the
        first one. Raises SafenavError if no further cases can run."""
        futures = []
        with contextlib.suppress(Empty):
            futures.append(self._done.get(timeout=seconds))
            while True:
                futures.append(self._done.get_nowait())
        cases = [(future, self._cases.pop(future)) for future in futures]
        return [(case, *self._ended(future, case)) for future, case in cases]

    def close(self) -> None:
        """Stop all work, and end all processes of the pool."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        leave(self.batch)
        self._threads.shutdown()

    def _ended(self, future: Any, case: Case) -> tuple[Result, bytes]:
        del case
        result: tuple[Result, bytes] = future.result()
        return result


def version_here() -> str:
    return safenav.__version__


class DaskCluster(Pool):
    """A pool on the cluster at ``address``. Its threads determine how many cases run in parallel.

    Raises UsageError if ``distributed`` is not installed, the address has no scheduler, or a worker
    there has no safenav of this version.
    """

    def __init__(self, address: str, conditions: Conditions) -> None:
        super().__init__(1, conditions)
        with needing("a Dask cluster", "dask"):
            dask = importlib.import_module("distributed")  # imported here: large and optional
        self._address = address
        try:
            self._client = dask.Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise UsageError(f"no Dask cluster answers at {address}: {error}") from error
        self._submit = partial(self._client.submit, pure=False)
        try:
            self._check_versions()
        except SafenavError:
            self._client.close()
            raise

    def close(self) -> None:
        if self._client.status == "closed":
            return
        with contextlib.suppress(Exception):  # without the cluster, no work is left to stop
            self._client.cancel(list(self._cases), force=True)
            self._client.run(leave, self.batch)
        self._cases.clear()
        self._client.close()

    def _ended(self, future: Any, case: Case) -> tuple[Result, bytes]:
        try:
            return super()._ended(future, case)
        except SafenavError as error:
            return case.result(CaseVerdict.ERROR, [str(error)]), b""
        except Exception as error:
            if future.status in ("cancelled", "lost"):
                raise SafenavError(
                    f"the Dask cluster at {self._address} is gone: {error}\n"
                    "    with --out the results so far are kept; continue with --resume"
                ) from error
            verdict, reason = CaseVerdict.ERROR, f"on the cluster: {type(error).__name__}: {error}"
            if type(error).__name__ == "KilledWorker":
                verdict = CaseVerdict.CRASHED
                reason = f"the Dask workers that ran this case died, one after the other: {error}"
            return case.result(verdict, [reason]), b""

    def _check_versions(self) -> None:
        """Compare safenav's version on the connected workers, if any. Raises UsageError."""
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
                    f"the Dask worker {worker} has safenav {version}, this machine has "
                    f"{safenav.__version__}\n    install the same version on both"
                )
