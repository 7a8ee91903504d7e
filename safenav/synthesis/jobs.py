"""Works off questions to the synthesizer, several at a time."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence

from safenav.synthesis.process import Crew, DismissedError
from safenav.synthesis.program import Brought, Program
from safenav.synthesis.request import Job, Listener, RequestPhase
from safenav.synthesis.verdict import SynthesisResult

_HEARTBEAT_SECONDS = 1.0

_News = tuple[Job, Brought | BaseException | None]
"""A job and what became of it: None when it starts."""


def work_off(
    program: Program,
    jobs: Sequence[Job],
    at_once: int,
    conclude: Callable[[Job, Brought], SynthesisResult],
    tell: Listener,
) -> dict[int, SynthesisResult]:
    """The results of jobs by their indices. Threads run the program; what they bring is
    concluded, and told, in the caller's thread. Whatever ends this ends the programs, too."""
    _ = program.binary.native  # asked here once, not in every thread
    results: dict[int, SynthesisResult] = {}
    crew = Crew()
    todo: queue.SimpleQueue[Job] = queue.SimpleQueue()
    news: queue.SimpleQueue[_News] = queue.SimpleQueue()
    for job in jobs:
        todo.put(job)
    count = min(len(jobs), at_once)
    workers = [
        threading.Thread(target=_labour, args=(program, crew, todo, news), daemon=True)
        for _ in range(count)
    ]
    try:
        for worker in workers:
            worker.start()
        started: dict[int, tuple[Job, float]] = {}
        left = len(jobs)
        while left:
            try:
                job, brought = news.get(timeout=_HEARTBEAT_SECONDS)
            except queue.Empty:
                for running, since in started.values():
                    tell(running.progress(RequestPhase.RUNNING, time.monotonic() - since))
                continue
            if brought is None:
                started[job.index] = (job, time.monotonic())
                tell(job.progress(RequestPhase.STARTED, 0.0))
                continue
            if isinstance(brought, BaseException):
                raise brought
            result = conclude(job, brought)
            results[job.index] = result
            started.pop(job.index, None)
            left -= 1
            tell(job.progress(RequestPhase.FINISHED, result.seconds, result))
    finally:
        crew.dismiss()
        for worker in workers:
            if worker.ident is not None:
                worker.join()
    return results


def _labour(
    program: Program, crew: Crew, todo: queue.SimpleQueue[Job], news: queue.SimpleQueue[_News]
) -> None:
    """The loop of a thread: take a job, run the binary, bring what it printed."""
    while True:
        try:
            job = todo.get_nowait()
        except queue.Empty:
            return
        news.put((job, None))
        try:
            news.put((job, program.answer(crew, job)))
        except DismissedError:
            return
        except BaseException as error:
            news.put((job, error))
            return
