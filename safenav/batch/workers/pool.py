"""Cases on this machine: some worker processes, each with one case at a time.

One thread waits for all of them. A worker that crashes or hangs fails only its own case, and is
replaced.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections import deque
from collections.abc import Iterable
from pathlib import Path

from safenav.batch.cases.case import Case, Conditions
from safenav.batch.session import Arrival
from safenav.batch.workers.worker import Worker, with_news


class LocalPool:
    """At most ``jobs`` cases run in parallel. ``traces``: directory for traces, if any;
    ``started``: running workers, which the pool takes over."""

    def __init__(
        self,
        jobs: int,
        conditions: Conditions,
        traces: Path | None = None,
        started: Iterable[Worker] = (),
    ) -> None:
        self._jobs = jobs
        self._conditions = conditions
        self._traces = traces
        self._todo: deque[Case] = deque()
        self._idle: list[Worker] = list(started)
        self._busy: dict[Worker, Path | None] = {}
        self._number = 0
        self._processors = _processors(jobs)
        self._placed: dict[Worker, int] = {}

    def submit(self, case: Case) -> None:
        self._todo.append(case)

    def collect(self, seconds: float) -> list[Arrival]:
        """Return the results that have arrived, waiting at most ``seconds`` for the first."""
        end = time.monotonic() + seconds
        while True:
            self._hand_out()
            arrived = [arrival for worker in self._due(end) if (arrival := self._take(worker))]
            if arrived:
                self._hand_out()
            if arrived or time.monotonic() >= end or not self._busy:
                return arrived

    def running(self) -> list[tuple[str, float]]:
        return [(w.case.name, w.elapsed) for w in self._busy if w.case is not None]

    def close(self) -> None:
        for worker in [*self._busy, *self._idle]:
            worker.end()
        self._busy.clear()
        self._idle.clear()
        self._todo.clear()

    def _hand_out(self) -> None:
        while self._todo and len(self._busy) < self._jobs:
            worker = self._idle.pop() if self._idle else Worker()
            self._place(worker)
            trace = None
            if self._traces is not None:
                self._number += 1
                trace = self._traces / f"{self._number}.jsonl"
            self._busy[worker] = trace
            worker.give(self._todo.popleft(), self._conditions, trace)

    def _due(self, end: float) -> list[Worker]:
        """Return the workers that have a message or no time left."""
        if not self._busy:
            return []
        until = min(end - time.monotonic(), *(w.seconds_left for w in self._busy))
        readable = with_news(self._busy, max(0.0, until))
        return [w for w in self._busy if w in readable or w.seconds_left <= 0]

    def _take(self, worker: Worker) -> Arrival | None:
        case = worker.case
        result = worker.receive()
        if result is None:
            return None
        assert case is not None
        trace = self._busy.pop(worker)
        if worker.alive:
            self._idle.append(worker)
        else:
            self._placed.pop(worker, None)
        return Arrival(case, result, trace)

    def _place(self, worker: Worker) -> None:
        """Bind a worker and its syntheses to one processor: they take turns, and migration costs an
        eighth of the time of small cases.
        """
        free = self._processors - set(self._placed.values())
        if worker not in self._placed and free:
            self._placed[worker] = min(free)
            with contextlib.suppress(OSError):  # it may have crashed already
                os.sched_setaffinity(worker.pid, {self._placed[worker]})


def _processors(jobs: int) -> frozenset[int]:
    """Return the processors to which workers are bound: none with one job, with more jobs than
    processors, or where the system cannot bind processes."""
    if not hasattr(os, "sched_getaffinity"):
        return frozenset()
    available = os.sched_getaffinity(0)
    return frozenset(available) if 1 < jobs <= len(available) else frozenset()
