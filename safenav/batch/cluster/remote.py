"""The program on a Dask worker: a case in a process of its own, kept for the next case.

A case that crashes or hangs thus costs neither the Dask worker nor the cases beside it.
"""

from __future__ import annotations

import tempfile
import threading
from collections import defaultdict
from pathlib import Path
from typing import Any

import safenav
from safenav.batch.cases.case import Case, Conditions
from safenav.batch.workers.worker import Worker

_lock = threading.Lock()
_idle: dict[str, list[Worker]] = defaultdict(list)
_busy: dict[str, set[Worker]] = defaultdict(set)
"""Worker processes here by batch: several batches may share a cluster."""


def version_here() -> str:
    return safenav.__version__


def run_case(
    batch: str, directory: str, case: dict[str, Any], conditions: dict[str, Any], traced: bool
) -> tuple[dict[str, Any], bytes]:
    """The result of a case as a record, and the trace if it is wanted and the case failed.
    ``directory``: where the batch runs; files that a scenario names are read as from there.

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
    """End all worker processes of a batch that is over."""
    with _lock:
        for worker in _idle.pop(batch, []):
            worker.end()
        for worker in _busy.pop(batch, set()):
            worker.kill()  # the thread that waits for it does the rest
