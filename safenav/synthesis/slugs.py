"""The synthesizer: specifications in, typed results out, several at a time.

    result = Synthesizer().synthesize(specification)
    if result.verdict is Verdict.REALIZABLE: drive(result.strategy)

Every answer is one of: a proven verdict (perhaps from the cache), a spent limit, or a
SynthesizerError that says what went wrong with the program.
"""

from __future__ import annotations

import hashlib
import os
import queue
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Union

from safenav.errors import SynthesizerError
from safenav.scenario.model import Controllers, Limits
from safenav.spec.specification import Section, Specification
from safenav.synthesis.answer import failure, too_large, verdict_of
from safenav.synthesis.binary import Binary, find_binary, find_own_binary
from safenav.synthesis.cache import Cache, Entry, key_of
from safenav.synthesis.process import Crew, DismissedError, Finished, limited, orderly_termination
from safenav.synthesis.strategy import Strategy
from safenav.synthesis.verdict import SynthesisResult, Verdict

if TYPE_CHECKING:
    from safenav.synthesis.serving.served import ServedStrategy

_GOOD = Verdict.REALIZABLE
_HEARTBEAT_SECONDS = 1.0
_OVERTIME_SECONDS = 1.0
"""Our own binary keeps its time limit itself, to say how far it got; then we end it."""


class Question(StrEnum):
    """What is asked; the value names it in the cache."""

    REALIZABILITY = "realizability"
    STRATEGY = "strategy"
    COUNTERSTRATEGY = "counterstrategy"
    MOVES = "moves"

    @property
    def options(self) -> tuple[str, ...]:
        """Options that every slugs binary knows; without any, the verdict alone is given."""
        match self:
            case Question.REALIZABILITY | Question.MOVES:
                return ()
            case Question.STRATEGY:
                return ("--explicitStrategy", "--jsonOutput")
            case Question.COUNTERSTRATEGY:
                return ("--counterStrategy", "--jsonOutput")

    @property
    def answered_by(self) -> Verdict:
        """The verdict with which an automaton is printed."""
        if self is Question.COUNTERSTRATEGY:
            return Verdict.UNREALIZABLE
        return Verdict.REALIZABLE


class Phase(StrEnum):
    STARTED = "started"
    RUNNING = "running"
    FINISHED = "finished"


@dataclass(frozen=True)
class SynthesisProgress:
    """Something happened in a synthesis: it started, still runs (told once a second), or
    finished with a result. ``index``: which of the specifications asked about."""

    index: int
    robot: str
    phase: Phase
    seconds: float
    result: SynthesisResult | None = None


Listener = Callable[[SynthesisProgress], None]

Verifier = Callable[[Specification, Strategy, bool], str | None]
"""Checks an automaton against its specification (the flag: it is a counterstrategy); what is
wrong with it in words, None if nothing is. Handed in, so that this package and the check know
nothing of each other."""


class Synthesizer:
    """Asks a slugs binary, within limits, and remembers what it said.

    ``binary``: default as ``find_binary`` finds it. ``seconds`` (wall) and ``memory_mb`` limit
    each single synthesis; None for no limit. ``cache``: default as the environment says.
    ``verifier`` checks every automaton against its specification before it is returned; one
    that fails is a SynthesizerError. ``at_once``: most syntheses at a time, default one a
    processor. ``controllers``: whether strategies are listed or give their moves on demand;
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
        """The verdict, and the strategy if there is one and it is wanted.

        Raises SynthesizerError if the binary is missing, crashes or prints nonsense.
        """
        return self.synthesize_all([spec], strategy)[0]

    def counterstrategy(self, spec: Specification) -> SynthesisResult:
        """The verdict, and for an unrealizable specification the environment's strategy.

        A foreign binary does not print it as JSON; then safenav's own is asked.
        """
        if self.binary.native:
            return self._ask_all([spec], Question.COUNTERSTRATEGY, None)[0]
        own = find_own_binary()
        if own is None or not own.native:
            raise SynthesizerError(
                f"the synthesizer {self.binary.path} gives no counterstrategies as JSON, and "
                "safenav's own binary is missing: run `make slugs` or `pip install .`"
            )
        return Synthesizer(
            own,
            seconds=self.seconds,
            memory_mb=self.memory_mb,
            cache=self.cache,
            verifier=self.verifier,
        ).counterstrategy(spec)

    def synthesize_all(
        self,
        specs: Sequence[Specification],
        strategy: bool = True,
        progress: Listener | None = None,
    ) -> list[SynthesisResult]:
        """Results in the order of ``specs``, computed at once on the machine's processors.

        ``progress`` is called in the caller's thread. On an error, Ctrl-C or SIGTERM all
        running syntheses are killed before the exception leaves.
        """
        if not strategy:
            return self._ask_all(specs, Question.REALIZABILITY, progress)
        if self.controllers is Controllers.ON_DEMAND:
            return self._ask_all(specs, Question.MOVES, progress)
        results = self._ask_all(specs, Question.STRATEGY, progress)
        if self.controllers is Controllers.LISTED:
            return results
        unlisted = [i for i, r in enumerate(results) if r.verdict is _GOOD and r.strategy is None]
        served = self._ask_all([specs[i] for i in unlisted], Question.MOVES, progress)
        for index, result in zip(unlisted, served, strict=True):
            results[index] = result
        return results

    def _ask_all(
        self, specs: Sequence[Specification], question: Question, progress: Listener | None
    ) -> list[SynthesisResult]:
        tell = progress or (lambda _: None)
        results: list[SynthesisResult | None] = [None] * len(specs)
        jobs = []
        for index, spec in enumerate(specs):
            most = self.states if self.controllers is Controllers.AUTO else None
            job = _Job(index, spec, spec.to_structuredslugs(), question, most)
            self.cache.keep_text(hashlib.sha256(job.text.encode()).hexdigest(), job.text)
            begun = time.monotonic()
            remembered = self._remembered(job)
            if remembered is None:
                jobs.append(job)
                continue
            results[index] = remembered
            elapsed = time.monotonic() - begun
            tell(SynthesisProgress(index, spec.robot, Phase.FINISHED, elapsed, remembered))
        if jobs:
            with orderly_termination():
                self._work_off(jobs, results, tell)
        return [result for result in results if result is not None]

    def _work_off(
        self, jobs: Sequence[_Job], results: list[SynthesisResult | None], tell: Listener
    ) -> None:
        """Run the jobs in threads; turn what they bring into results here."""
        native = self.binary.native  # asked here once, not in every thread
        crew = Crew()
        todo: queue.SimpleQueue[_Job] = queue.SimpleQueue()
        news: queue.SimpleQueue[_News] = queue.SimpleQueue()
        for job in jobs:
            todo.put(job)
        count = min(len(jobs), self.at_once)
        workers = [
            threading.Thread(target=self._labour, args=(crew, native, todo, news), daemon=True)
            for _ in range(count)
        ]
        try:
            for worker in workers:
                worker.start()
            started: dict[int, tuple[_Job, float]] = {}
            left = len(jobs)
            while left:
                try:
                    job, brought = news.get(timeout=_HEARTBEAT_SECONDS)
                except queue.Empty:
                    for running, since in started.values():
                        tell(running.progress(Phase.RUNNING, time.monotonic() - since))
                    continue
                if brought is None:
                    started[job.index] = (job, time.monotonic())
                    tell(job.progress(Phase.STARTED, 0.0))
                    continue
                if isinstance(brought, BaseException):
                    raise brought
                result = self._result(job, brought)
                results[job.index] = result
                started.pop(job.index, None)
                left -= 1
                tell(job.progress(Phase.FINISHED, result.seconds, result))
        finally:
            crew.dismiss()
            for worker in workers:
                if worker.ident is not None:
                    worker.join()

    def _labour(
        self,
        crew: Crew,
        native: bool,
        todo: queue.SimpleQueue[_Job],
        news: queue.SimpleQueue[_News],
    ) -> None:
        """What a thread does: take a job, run the binary, bring what it printed."""
        while True:
            try:
                job = todo.get_nowait()
            except queue.Empty:
                return
            news.put((job, None))
            try:
                news.put((job, self._bring(crew, native, job)))
            except DismissedError:
                return
            except BaseException as error:
                news.put((job, error))
                return

    def _bring(self, crew: Crew, native: bool, job: _Job) -> _Brought:
        if job.question is Question.MOVES:
            # Imported here: few runs need it.
            from safenav.synthesis.serving.starting import serve

            begun = time.monotonic()
            own = self.binary if native else find_own_binary()
            served = serve(
                job.spec,
                own,
                options=job.options,
                seconds=self.seconds,
                memory_mb=self.memory_mb,
                crew=crew,
            )
            return served, time.monotonic() - begun
        return (self._run_native if native else self._run_foreign)(crew, job)

    def _run_native(self, crew: Crew, job: _Job) -> Finished:
        """Our own program reads standard input and keeps its limits itself."""
        command = [str(self.binary.path), *job.options]
        if job.question is Question.REALIZABILITY:
            command.append("--realizability")
        if job.question is Question.STRATEGY and job.most_nodes is not None:
            command += ["--nodes", str(job.most_nodes)]
        deadline = None
        if self.seconds is not None:
            command += ["--timeout", f"{self.seconds:g}"]
            deadline = self.seconds + _OVERTIME_SECONDS
        if self.memory_mb is not None:
            command += ["--memory", str(self.memory_mb)]
        return crew.run([*command, "-"], job.text.encode(), deadline, self.memory_mb)

    def _run_foreign(self, crew: Crew, job: _Job) -> Finished:
        """Upstream's program reads slugsin files only and knows no limits."""
        # Imported here: it is slow, and our own binary needs no files.
        import tempfile

        text, suffix = self._translated(crew, job)
        with tempfile.TemporaryDirectory(prefix="safenav-") as directory:
            file = Path(directory) / f"specification{suffix}"
            file.write_bytes(text)
            command = [str(self.binary.path), *job.options, str(file)]
            return crew.run(limited(command, self.memory_mb), b"", self.seconds, self.memory_mb)

    def _translated(self, crew: Crew, job: _Job) -> tuple[bytes, str]:
        """The specification as slugsin if our own binary is there to translate it."""
        own = find_own_binary()
        given = job.text.encode()
        if own is None or not own.native:
            return given, ".structuredslugs"
        translated = crew.run([str(own.path), "--translate", "-"], given, self.seconds)
        if translated.timed_out or translated.status != 0:
            raise failure("does not translate the specification", translated, own, job.robot)
        return translated.stdout, ".slugsin"

    def _remembered(self, job: _Job) -> SynthesisResult | None:
        """The cached result, if it is there and stands every check that a fresh one stands."""
        if self.cache.directory is None or job.question is Question.MOVES:
            return None
        if job.most_nodes is not None and job.question is Question.STRATEGY:
            entry = self.cache.load(self._too_large_key(job))
            if entry is not None:
                return self._checked(job, entry, cached=True)
        key = self._key(job)
        entry = self.cache.load(key)
        if entry is None:
            return None
        try:
            result = self._checked(job, entry, cached=True)
        except SynthesizerError:
            self.cache.drop(key)
            return None
        if job.most_nodes is not None and (result.states or 0) > job.most_nodes:
            return self._checked(job, replace(entry, strategy_json=None), cached=True)
        return result

    def _result(self, job: _Job, finished: Finished | _Served) -> SynthesisResult:
        if not isinstance(finished, Finished):
            found, seconds = finished
            if isinstance(found, Verdict):
                return self._checked(job, Entry(found, seconds, None), cached=False)
            return replace(
                self._checked(job, Entry(Verdict.REALIZABLE, seconds, None), cached=False),
                served=found,
            )
        if too_large(finished) and job.most_nodes is not None:
            entry = Entry(Verdict.REALIZABLE, finished.seconds, None)
            self.cache.store(self._too_large_key(job), entry)
            return self._checked(job, entry, cached=False)
        verdict = verdict_of(finished, self.binary, job.robot)
        wanted = job.question is not Question.REALIZABILITY
        automaton = wanted and verdict is job.question.answered_by
        entry = Entry(verdict, finished.seconds, finished.stdout if automaton else None)
        try:
            result = self._checked(job, entry, cached=False, detail=finished.explanation)
        except SynthesizerError as error:
            raise failure(
                f"gave a wrong answer: {error}", finished, self.binary, job.robot
            ) from error
        if self.cache.directory is not None:
            self.cache.store(self._key(job), entry)
        return result

    def _checked(
        self, job: _Job, entry: Entry, *, cached: bool, detail: str = ""
    ) -> SynthesisResult:
        """The result of an answer. Raises SynthesizerError if its automaton is no automaton, or
        is verified and fails."""
        data = entry.strategy_json
        strategy = None if data is None else Strategy.parse(data, job.spec)
        verified = None
        if strategy is not None and self.verifier is not None:
            counter = job.question is Question.COUNTERSTRATEGY
            failure_found = self.verifier(job.spec, strategy, counter)
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

    def _key(self, job: _Job) -> str:
        return key_of(job.text, self.binary.digest, (job.question, *job.options))

    def _too_large_key(self, job: _Job) -> str:
        """Of the fact that a strategy has more nodes than may be listed."""
        limit = ("more nodes than", str(job.most_nodes))
        return key_of(job.text, self.binary.digest, (job.question, *job.options, *limit))


@dataclass(frozen=True)
class _Job:
    """One question about one specification."""

    index: int
    spec: Specification
    text: str
    question: Question
    most_nodes: int | None = None

    @property
    def robot(self) -> str:
        return self.spec.robot

    @property
    def options(self) -> tuple[str, ...]:
        """The options for the binary. A strategy that relies on fairness assumptions shall move
        on where it can by itself, and wait for the others only where it must."""
        options = self.question.options
        moves = self.question in (Question.STRATEGY, Question.MOVES)
        if moves and self.spec.section(Section.ENV_LIVENESS):
            options += ("--biasForAction",)
        return options

    def progress(
        self, phase: Phase, seconds: float, result: SynthesisResult | None = None
    ) -> SynthesisProgress:
        return SynthesisProgress(self.index, self.robot, phase, seconds, result)


_Served = tuple[Union["ServedStrategy", Verdict], float]
"""What became of a server, and the seconds until then."""

_Brought = Finished | _Served

_News = tuple[_Job, _Brought | BaseException | None]
"""A job and what became of it: None when it starts."""
