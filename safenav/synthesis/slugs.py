"""The synthesizer: specifications in, typed results out, several at a time.

    result = Synthesizer().synthesize(specification)
    if result.verdict is Verdict.REALIZABLE: drive(result.strategy)

Every result is one of: a proven verdict (perhaps from the cache), an exhausted limit, or a
SynthesizerError with the program's failure.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Union

from msgspec.structs import replace

from safenav.errors import SynthesizerError
from safenav.outcome import Verdict
from safenav.scenario.settings import Controllers, Limits
from safenav.spec.specification import Specification
from safenav.synthesis.binary import Binary, find_binary, find_own_binary
from safenav.synthesis.cache import Cache, CacheEntry, key_of
from safenav.synthesis.process import (
    OVERTIME_SECONDS,
    Finished,
    ProcessGroup,
    limited,
    limits,
    orderly_termination,
)
from safenav.synthesis.request import Job, Listener, RequestKind, SynthesisProgress, SynthesisResult
from safenav.synthesis.result import failure, too_large, verdict_of
from safenav.synthesis.strategy import Strategy

if TYPE_CHECKING:
    from safenav.synthesis.serving.served import ServedStrategy


Brought = Finished | tuple[Union["ServedStrategy", Verdict], float]
"""The output of a program, or the end of a server with the seconds until then."""


_GOOD = Verdict.REALIZABLE
_HEARTBEAT_SECONDS = 0.5

Verifier = Callable[[Specification, Strategy, bool, Callable[[], None]], str | None]
"""Check of an automaton against its specification (the flag: it is a counterstrategy). Returns its
error in words, or None. It calls the last argument regularly, which raises to end the check. A
parameter, so that this package and the check are independent of each other."""


class Synthesizer:
    """Calls a slugs binary within limits, and caches its results.

    ``binary``: default that of ``find_binary``. ``seconds`` (wall) and ``memory_mb`` limit each
    single synthesis; None for no limit. ``cache``: default by the environment. ``verifier`` checks
    every automaton against its specification before it is returned; one that fails is a
    SynthesizerError. ``at_once``: maximum number of simultaneous syntheses, default one per
    processor. ``controllers``: whether strategies are explicit or give their moves on demand;
    ``auto`` lists those of at most ``states`` nodes (with safenav's own binary).
    """

    def __init__(
        self,
        binary: Binary | Path | None = None,
        *,
        seconds: float | None = 60.0,
        memory_mb: int | None = 2048,
        cache: Cache | None = None,
        verifier: Verifier | None = None,
        at_once: int | None = None,
        controllers: Controllers = Controllers.LISTED,
        states: int = Limits().states,
    ) -> None:
        self.binary = Binary(binary) if isinstance(binary, Path) else binary or find_binary()
        self.seconds = seconds
        self.memory_mb = memory_mb
        self.cache = Cache.from_environment() if cache is None else cache
        self.verifier = verifier
        self.at_once = at_once or os.cpu_count() or 1
        self.controllers = controllers
        self.states = states

    def synthesize(self, spec: Specification, strategy: bool = True) -> SynthesisResult:
        """Return the verdict, and the strategy if there is one and ``strategy`` is true.

        Raises SynthesizerError if the binary is missing, crashes or prints invalid output.
        """
        return self.synthesize_all([spec], strategy)[0]

    def counterstrategy(self, spec: Specification) -> SynthesisResult:
        """Return the verdict, and for an unrealizable specification the environment's strategy.

        A foreign binary does not print it as JSON; then safenav's own is used.
        """
        if self.binary.native:
            return self._ask_all([spec], RequestKind.COUNTERSTRATEGY, None)[0]
        own = find_own_binary()
        if own is None or not own.native:
            raise SynthesizerError(
                f"the synthesizer {self.binary.path} gives no counterstrategies as JSON, and "
                "safenav's own binary is missing: run `make slugs` or `pip install .`"
            )
        native = copy(self)
        native.binary = own
        return native.counterstrategy(spec)

    def synthesize_all(
        self,
        specs: Sequence[Specification],
        strategy: bool = True,
        progress: Listener | None = None,
    ) -> list[SynthesisResult]:
        """Results in the order of ``specs``, computed in parallel on the machine's processors.

        ``progress`` is called in the caller's thread. On an error, Ctrl-C or SIGTERM all
        running syntheses are killed before the exception leaves.
        """
        if not strategy:
            return self._ask_all(specs, RequestKind.REALIZABILITY, progress)
        if self.controllers is Controllers.ON_DEMAND:
            return self._ask_all(specs, RequestKind.MOVES, progress)
        results = self._ask_all(specs, RequestKind.STRATEGY, progress)
        if self.controllers is Controllers.LISTED:
            return results
        unlisted = [i for i, r in enumerate(results) if r.verdict is _GOOD and r.strategy is None]
        served = self._ask_all([specs[i] for i in unlisted], RequestKind.MOVES, progress)
        for index, result in zip(unlisted, served, strict=True):
            results[index] = result
        return results

    def _ask_all(
        self, specs: Sequence[Specification], kind: RequestKind, progress: Listener | None
    ) -> list[SynthesisResult]:
        report = progress or (lambda _: None)
        results: list[SynthesisResult | None] = [None] * len(specs)
        jobs = []
        most = self.states if self.controllers is Controllers.AUTO else None
        for index, spec in enumerate(specs):
            job = Job(index, spec, spec.to_structuredslugs(), kind, most)
            self.cache.keep_text(hashlib.sha256(job.text.encode()).hexdigest(), job.text)
            begun = time.monotonic()
            remembered = self._remembered(job, report)
            if remembered is None:
                jobs.append(job)
                continue
            results[index] = remembered
            elapsed = time.monotonic() - begun
            report(SynthesisProgress(index, spec.robot, elapsed, remembered))
        if jobs:
            with orderly_termination():
                for index, result in self._worked_off(jobs, report).items():
                    results[index] = result
        return [result for result in results if result is not None]

    def _worked_off(self, jobs: Sequence[Job], report: Listener) -> dict[int, SynthesisResult]:
        """Return the results of jobs by their indices. Threads run the program; its results are
        read, and reported, in the caller's thread. Any exception also ends the programs."""
        _ = self.binary.native  # queried once here, not in every thread
        crew = ProcessGroup()
        waiting, running = deque(jobs), dict[int, tuple[Job, float]]()
        ended = SimpleQueue[tuple[Job, Brought | BaseException]]()
        results: dict[int, SynthesisResult] = {}

        def work() -> None:
            with suppress(IndexError):  # no job is left
                while True:
                    job = waiting.popleft()
                    running[job.index] = job, time.monotonic()
                    try:
                        ended.put((job, self._run(crew, job)))
                    except BaseException as error:
                        ended.put((job, error))

        threads: list[Thread] = []
        try:
            for _ in range(min(len(jobs), self.at_once)):
                thread = Thread(target=work, name="synthesis")
                thread.start()
                threads.append(thread)
            while len(results) < len(jobs):
                try:
                    job, brought = ended.get(timeout=_HEARTBEAT_SECONDS)
                except Empty:
                    now = time.monotonic()
                    for job, begun in tuple(running.values()):
                        report(SynthesisProgress(job.index, job.robot, now - begun))
                    continue
                del running[job.index]
                if isinstance(brought, BaseException):
                    raise brought
                results[job.index] = result = self._result(job, brought, report)
                report(SynthesisProgress(job.index, job.robot, result.seconds, result))
        finally:
            waiting.clear()
            crew.dismiss()
            for thread in threads:
                thread.join()
        return results

    def _run(self, crew: ProcessGroup, job: Job) -> Brought:
        """Run until the job has a result. Raises SynthesizerError; DismissedError with the crew."""
        if job.kind is RequestKind.MOVES:
            # Imported here: few runs need it.
            from safenav.synthesis.serving.served import serve

            begun = time.monotonic()
            own = self.binary if self.binary.native else find_own_binary()
            served = serve(
                job.spec,
                own,
                options=job.options,
                seconds=self.seconds,
                memory_mb=self.memory_mb,
                crew=crew,
            )
            return served, time.monotonic() - begun
        return (self._run_native if self.binary.native else self._run_foreign)(crew, job)

    def _run_native(self, crew: ProcessGroup, job: Job) -> Finished:
        """Run safenav's own program, which reads standard input and enforces its limits itself."""
        command = [str(self.binary.path), *job.options]
        if job.kind is RequestKind.REALIZABILITY:
            command.append("--realizability")
        if job.kind is RequestKind.STRATEGY and job.most_nodes is not None:
            command += ["--nodes", str(job.most_nodes)]
        command += [*limits(self.seconds, self.memory_mb), "-"]
        deadline = None if self.seconds is None else self.seconds + OVERTIME_SECONDS
        return crew.run(command, job.text.encode(), deadline, self.memory_mb, self.binary.ours)

    def _run_foreign(self, crew: ProcessGroup, job: Job) -> Finished:
        """Run upstream's program, which reads slugsin files only and has no limits."""
        # Imported here: it is slow, and safenav's own binary needs no files.
        import tempfile

        text, suffix = job.text.encode(), ".structuredslugs"
        own = find_own_binary()
        if own is not None and own.native:  # it translates to slugsin
            translate = [str(own.path), "--translate", "-"]
            translated = crew.run(translate, text, self.seconds, own=own.ours)
            if translated.timed_out:
                return translated
            if translated.status != 0:
                raise failure("does not translate the specification", translated, own, job.robot)
            text, suffix = translated.stdout, ".slugsin"
        with tempfile.TemporaryDirectory(prefix="safenav-") as directory:
            file = Path(directory) / f"specification{suffix}"
            file.write_bytes(text)
            command = [str(self.binary.path), *job.options, str(file)]
            return crew.run(limited(command, self.memory_mb), b"", self.seconds, self.memory_mb)

    def _remembered(self, job: Job, report: Listener) -> SynthesisResult | None:
        """Return the cached result, if it exists and passes every check of a fresh one."""
        if self.cache.directory is None or job.kind is RequestKind.MOVES:
            return None
        if job.most_nodes is not None and job.kind is RequestKind.STRATEGY:
            entry = self.cache.load(self._too_large_key(job))
            if entry is not None:
                return self._checked(job, entry, report, cached=True)
        key = self._key(job)
        if (entry := self.cache.load(key)) is None:
            return None
        try:
            result = self._checked(job, entry, report, cached=True)
        except SynthesizerError:
            self.cache.drop(key)
            return None
        if job.most_nodes is not None and (result.states or 0) > job.most_nodes:
            return self._checked(job, replace(entry, strategy_json=None), report, cached=True)
        return result

    def _result(self, job: Job, finished: Brought, report: Listener) -> SynthesisResult:
        if not isinstance(finished, Finished):
            found, seconds = finished
            verdict, served = (found, None) if isinstance(found, Verdict) else (_GOOD, found)
            result = self._checked(job, CacheEntry(verdict, seconds, None), report, cached=False)
            return replace(result, served=served)
        if too_large(finished) and job.most_nodes is not None:
            entry = CacheEntry(_GOOD, finished.seconds, None)
            self.cache.store(self._too_large_key(job), entry)
            return self._checked(job, entry, report, cached=False)
        verdict = verdict_of(finished, self.binary, job.robot)
        wanted = job.kind is not RequestKind.REALIZABILITY
        automaton = wanted and verdict is job.kind.ending
        entry = CacheEntry(verdict, finished.seconds, finished.stdout if automaton else None)
        try:
            result = self._checked(job, entry, report, cached=False, detail=finished.explanation)
        except SynthesizerError as error:
            raise failure(
                f"gave a wrong result: {error}", finished, self.binary, job.robot
            ) from error
        if self.cache.directory is not None:
            self.cache.store(self._key(job), entry)
        return result

    def _checked(
        self, job: Job, entry: CacheEntry, report: Listener, *, cached: bool, detail: str = ""
    ) -> SynthesisResult:
        """Return the result with its automaton. Raises SynthesizerError if that is malformed or
        fails verification."""
        data = entry.strategy_json
        strategy = None if data is None else Strategy.parse(data, job.spec)
        verified = None
        if strategy is not None and self.verifier is not None:
            counter = job.kind is RequestKind.COUNTERSTRATEGY
            failure_found = self.verifier(job.spec, strategy, counter, _heard_by(report, job))
            if failure_found is not None:
                raise SynthesizerError(f"the strategy is wrong: {failure_found}")
            verified = True
        return SynthesisResult(
            robot=job.robot,
            verdict=entry.verdict,
            seconds=entry.seconds,
            cached=cached,
            spec_sha256=hashlib.sha256(job.text.encode()).hexdigest(),
            strategy=strategy,
            strategy_json=data,
            strategy_sha256=None if data is None else hashlib.sha256(data).hexdigest(),
            detail=detail,
            verified=verified,
        )

    def _key(self, job: Job) -> str:
        return key_of(job.text, self.binary.digest, (job.kind, *job.options))

    def _too_large_key(self, job: Job) -> str:
        """Return the cache key for a strategy that has too many nodes to be listed."""
        limit = ("more nodes than", str(job.most_nodes))
        return key_of(job.text, self.binary.digest, (job.kind, *job.options, *limit))


def _heard_by(report: Listener, job: Job) -> Callable[[], None]:
    """Return a function that reports that a job still runs, at most once per heartbeat."""
    begun = last = time.monotonic()

    def alive() -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _HEARTBEAT_SECONDS:
            last = now
            report(SynthesisProgress(job.index, job.robot, now - begun))

    return alive
