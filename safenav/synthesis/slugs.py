"""The synthesizer, which turns specifications (also from files) into typed results, in parallel.

    result = Synthesizer().synthesize(specification)
    if result.verdict is Verdict.REALIZABLE: drive(result.strategy)

A synthesis ends with a proven verdict (perhaps from the cache), an exhausted limit, or a
SynthesizerError that names the program's failure.
"""

import hashlib
import os
import re
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from enum import IntEnum
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from weakref import WeakValueDictionary

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, ResourceLimitError, SynthesizerError, Verdict
from safenav.files import check_kind, decoded
from safenav.spec.specification import Section, Specification, read_specification
from safenav.synthesis.cache import Cache, CacheEntry, key_of
from safenav.synthesis.program import VARIABLE, Finished, ProcessGroup, find_binary, find_own_binary
from safenav.synthesis.strategy import Strategy

PRINTED: Mapping[Verdict, str] = {
    Verdict.REALIZABLE: "--explicitStrategy",
    Verdict.UNREALIZABLE: "--counterStrategy",
}
"""Options that print the automaton of a verdict."""


class SynthesisResult(Struct, frozen=True, weakref=True):
    """The result of one synthesis.

    ``strategy``: the strategy or counterstrategy, if it was requested and the verdict is realizable
    or unrealizable, respectively; else None. ``seconds``: wall time of the subprocess (if
    ``cached``, of the original one). ``spec_sha256`` and ``strategy_sha256``: hex digests of the
    structured-slugs text and of the JSON that the synthesizer printed. ``detail``: its last
    messages besides the verdict, such as its progress before a limit. ``verified``: True if an
    independent check has accepted the strategy, None without a check (a rejected strategy is an
    error, never a result).
    """

    robot: str
    verdict: Verdict
    seconds: float
    cached: bool
    spec_sha256: str
    strategy: Strategy | None = None
    strategy_json: bytes | None = None
    strategy_sha256: str | None = None
    detail: str = ""
    verified: bool | None = None

    @property
    def states(self) -> int | None:
        """The number of nodes of the strategy; None if there is none."""
        return len(self.strategy.states) if self.strategy is not None else None


class SynthesisProgress(Struct, frozen=True):
    """A synthesis that has finished with a ``result``, or still runs (reported twice per second).
    ``index``: the index of its specification."""

    index: int
    robot: str
    seconds: float
    result: SynthesisResult | None = None


Listener = Callable[[SynthesisProgress], None]


class Job(Struct, frozen=True):
    """One call of slugs. ``wanted``: the verdict whose automaton is requested, or None."""

    index: int
    spec: Specification
    text: str
    wanted: Verdict | None

    @property
    def sha256(self) -> str:
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def options(self) -> tuple[str, ...]:
        """The options for the binary. With fairness assumptions, a strategy moves if it can, and
        waits for other robots only if it must."""
        if self.wanted is None:
            return ()
        waits = self.wanted is Verdict.REALIZABLE and self.spec.section(Section.ENV_LIVENESS)
        return (PRINTED[self.wanted], "--jsonOutput", *(("--biasForAction",) if waits else ()))


_HEARTBEAT_SECONDS = 0.5
OVERTIME_SECONDS = 1.0
"""Seconds after the time limit at which the binary is killed. It normally keeps the limit itself
and reports its progress."""
_MOST_STATES = 200_000
"""Maximum number of nodes of a strategy. Those of single robots have tens to thousands."""

Verifier = Callable[[Specification, Strategy, bool], str | None]
"""A check of an automaton against its specification (the flag: it is a counterstrategy). It returns
the automaton's error in words, or None. The verifier is a parameter, so this package and the check
are independent."""


class Synthesizer:
    """A slugs binary with limits for its calls, and a cache of the results.

    ``binary``: by default that of ``find_binary``. ``seconds`` (wall time) and ``memory_mb`` limit
    each synthesis; None: no limit. ``cache``: by default that of the environment. ``verifier``
    checks every automaton against its specification before it is returned; a failure raises
    SynthesizerError. ``at_once``: maximum number of simultaneous syntheses, by default one per
    processor.
    """

    def __init__(
        self,
        binary: Path | None = None,
        *,
        seconds: float | None = 60.0,
        memory_mb: int | None = 2048,
        cache: Cache | None = None,
        verifier: Verifier | None = None,
        at_once: int | None = None,
    ) -> None:
        self.binary = binary or find_binary()
        self.seconds = seconds
        self.memory_mb = memory_mb
        self.cache = Cache.from_environment() if cache is None else cache
        self.verifier = verifier
        self.at_once = at_once or os.cpu_count() or 1
        self._in_use = WeakValueDictionary[str, SynthesisResult]()

    def synthesize(self, spec: Specification, strategy: bool = True) -> SynthesisResult:
        """Return the verdict, with a strategy if one exists and ``strategy`` is true.

        Raises SynthesizerError if the binary is missing, crashes or prints invalid output.
        """
        return self.synthesize_all([spec], strategy)[0]

    def counterstrategy(self, spec: Specification) -> SynthesisResult:
        """Return the verdict and, if it is unrealizable, the environment's strategy."""
        return self._ask_all([spec], Verdict.UNREALIZABLE, None)[0]

    def synthesize_all(
        self,
        specs: Sequence[Specification],
        strategy: bool = True,
        progress: Listener | None = None,
    ) -> list[SynthesisResult]:
        """Return the results in the order of ``specs``, computed in parallel on all processors.

        ``progress`` is called in the caller's thread. An error or Ctrl-C first kills all running
        syntheses.
        """
        return self._ask_all(specs, Verdict.REALIZABLE if strategy else None, progress)

    def _ask_all(
        self, specs: Sequence[Specification], wanted: Verdict | None, progress: Listener | None
    ) -> list[SynthesisResult]:
        report = progress or (lambda _: None)
        results: dict[int, SynthesisResult] = {}
        jobs = []
        for index, spec in enumerate(specs):
            job = Job(index, spec, spec.to_structuredslugs(), wanted)
            self.cache.keep_text(job.sha256, job.text)
            begun = time.monotonic()
            if (remembered := self._remembered(job)) is None:
                jobs.append(job)
                continue
            results[index] = remembered
            report(SynthesisProgress(index, spec.robot, time.monotonic() - begun, remembered))
        if jobs:
            results |= self._worked_off(jobs, report)
        return [results[index] for index in range(len(specs))]

    def _worked_off(self, jobs: Sequence[Job], report: Listener) -> dict[int, SynthesisResult]:
        """Return the results of jobs by their indices. Threads run the program; the caller's thread
        reads and reports the results. Any exception also ends the running programs."""
        crew = ProcessGroup()
        waiting, running = iter(jobs), dict[int, tuple[Job, float]]()
        ended = SimpleQueue[tuple[Job, Finished | BaseException]]()
        results: dict[int, SynthesisResult] = {}

        def work() -> None:
            for job in waiting:  # each thread takes the next job
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
                    job, finished = ended.get(timeout=_HEARTBEAT_SECONDS)
                except Empty:
                    now = time.monotonic()
                    for job, begun in tuple(running.values()):
                        report(SynthesisProgress(job.index, job.spec.robot, now - begun))
                    continue
                del running[job.index]
                if isinstance(finished, BaseException):
                    raise finished
                results[job.index] = result = self._result(job, finished)
                report(SynthesisProgress(job.index, result.robot, result.seconds, result))
        finally:
            crew.dismiss()
            for thread in threads:
                thread.join()
        return results

    def _run(self, crew: ProcessGroup, job: Job) -> Finished:
        """Run the program, which reads standard input and enforces the limits itself."""
        options = [*(job.options or ("--realizability",))]
        if job.wanted is Verdict.REALIZABLE:
            options += ["--nodes", str(_MOST_STATES)]
        options += [] if self.seconds is None else ["--timeout", f"{self.seconds:g}"]
        options += [] if self.memory_mb is None else ["--memory", str(self.memory_mb)]
        deadline = None if self.seconds is None else self.seconds + OVERTIME_SECONDS
        given = job.text.encode()
        return crew.run(self.binary, [*options, "-"], given, deadline, self.memory_mb)

    def _remembered(self, job: Job) -> SynthesisResult | None:
        """Return the cached result, or None. It must pass every check of a new result, unless an
        object in use has already passed them."""
        key = self._key(job)
        known = self._in_use.get(key)
        if known and known.strategy and known.strategy.specification == job.spec:
            return replace(known, cached=True)
        entry = self.cache.load(key)
        with suppress(SynthesizerError):
            if entry is not None:
                self._in_use[key] = result = self._checked(job, entry, cached=True)
                return result
        return None

    def _result(self, job: Job, finished: Finished) -> SynthesisResult:
        robot = job.spec.robot
        if finished.status == ExitStatus.RESOURCE_LIMIT and _TOO_MANY_NODES in finished.stderr:
            raise ResourceLimitError(
                f"the strategy of {robot} has more than {_MOST_STATES:,} states\n    expected "
                "tens to thousands; reduce the map, the memory, or the observed robots and inputs"
            )
        verdict = verdict_of(finished, self.binary, robot)
        printed = finished.stdout if verdict is job.wanted else None
        entry = CacheEntry(verdict, finished.seconds, printed)
        try:
            result = self._checked(job, entry, cached=False, detail=finished.explanation)
        except SynthesizerError as error:
            problem = f"gave a wrong result: {error}"
            raise failure(problem, finished, self.binary, robot) from error
        key = self._key(job)
        self.cache.store(key, entry)
        self._in_use[key] = result
        return result

    def _checked(
        self, job: Job, entry: CacheEntry, *, cached: bool, detail: str = ""
    ) -> SynthesisResult:
        """Return the result with its automaton. Raises SynthesizerError if the automaton is
        malformed or fails verification."""
        data, checked = entry.strategy_json, None
        strategy = None if data is None else Strategy.parse(data, job.spec)
        if strategy is not None and self.verifier is not None:
            wrong = self.verifier(job.spec, strategy, job.wanted is Verdict.UNREALIZABLE)
            if wrong is not None:
                raise SynthesizerError(f"the strategy is wrong: {wrong}")
            checked = True
        return SynthesisResult(
            robot=job.spec.robot,
            verdict=entry.verdict,
            seconds=entry.seconds,
            cached=cached,
            spec_sha256=job.sha256,
            strategy=strategy,
            strategy_json=data,
            strategy_sha256=None if data is None else hashlib.sha256(data).hexdigest(),
            detail=detail,
            verified=checked,
        )

    def _key(self, job: Job) -> str:
        try:
            rules = re.sub("(?m)^#.*\n", "", job.text)  # comments change no result
            return key_of(rules, _digest(self.binary, self.binary.stat().st_ctime_ns), job.options)
        except OSError as error:
            problem = f"cannot be read: {error.strerror}"
            raise SynthesizerError(f"the synthesizer {self.binary} {problem}") from error


@cache
def _digest(binary: Path, changed: int) -> str:  # noqa: ARG001 - part of the cache's key
    """Return the sha256 of a program in hex. Cached results are valid only for this program."""
    return hashlib.sha256(binary.read_bytes()).hexdigest()


_RESULT = re.compile(rb"^RESULT: Specification is (realizable|unrealizable)\b", re.MULTILINE)
_LIMITS = {b"time limit reached": Verdict.TIMEOUT, b"memory limit reached": Verdict.OUT_OF_MEMORY}
_TOO_MANY_NODES = b"slugs: node limit reached"


class ExitStatus(IntEnum):
    """Exit statuses of slugs (``slugs --help``)."""

    REALIZABLE = 0
    UNREALIZABLE = 10
    BAD_INPUT = 2
    RESOURCE_LIMIT = 3


def verdict_of(finished: Finished, binary: Path, robot: str) -> Verdict:
    """Return the verdict of a finished program: its RESULT line on standard error, confirmed by its
    exit status. Raises SynthesizerError, with the last messages, if there is none."""
    if finished.timed_out:
        return Verdict.TIMEOUT
    status, printed = finished.status, _RESULT.findall(finished.stderr)
    limited = status == ExitStatus.RESOURCE_LIMIT
    for words, verdict in _LIMITS.items():
        if limited and words in finished.stderr:
            return verdict
    if status == -signal.SIGKILL:
        problem = "was killed from outside (SIGKILL: perhaps the machine ran out of memory)"
    elif status < 0:
        names = (each.name for each in signal.Signals if each == -status)
        problem = f"crashed ({next(names, f'signal {-status}')})"
    elif limited:
        problem = "was interrupted from outside"
    elif status == ExitStatus.BAD_INPUT:
        problem = "rejects the specification"
    elif not printed:
        problem = f"printed no verdict (exit status {status})"
    else:
        verdict = Verdict(printed[-1].decode())
        if status == ExitStatus[verdict.name]:
            return verdict
        problem = f"printed {verdict}, but ended with exit status {status}"
    raise failure(problem, finished, binary, robot)


def failure(problem: str, finished: Finished, binary: Path, robot: str) -> SynthesizerError:
    """Return an error with the problem, the synthesizer's last messages, and advice."""
    lines = [f"the synthesizer {binary} {problem} (robot '{robot}')"]
    words = finished.explanation.splitlines()
    lines.append("    its last output:" if words else "    it printed nothing")
    lines += [f"      {line}" for line in words]
    advice = "`safenav synth -o DIR` writes the specification: attach it to a bug report"
    if os.environ.get(VARIABLE):
        advice = f"check the binary that {VARIABLE} names, or unset it to use safenav's own"
    return SynthesizerError("\n".join([*lines, f"    {advice}"]))


_ERROR = re.compile(r"-:(?:(\d+):(\d+):)? error: (.*)")
_WARNING = re.compile(r"(?m)^-:(\d+:\d+): warning: (.*)")
_HINT = re.compile(r"\s*hint: (.*)")
_TRANSLATE = ("--translate", "-")
_TRANSLATION_SECONDS = 60.0
MOST_OF_A_TEXT = 20_000_000
"""Maximum size of a specification's text, in bytes."""


def specification_in(
    data: bytes, file: str, robot: str, warn: Callable[[str], object] = lambda _: None
) -> Specification:
    """Return the specification in a file. ``warn`` receives the warnings of safenav's synthesizer.
    Raises InputError with all errors that the synthesizer finds in the text."""
    text = decoded(data, file)
    check_kind(text, "specification", file)
    done = _translated(text.encode())
    told = "" if done is None else done.stderr.decode("utf-8", "replace")
    if done is not None and done.status == ExitStatus.BAD_INPUT:
        raise InputError(_diagnostics(told, file, text))
    for place, words in _WARNING.findall(told):
        warn(f"{file}:{place}: {words}")
    return read_specification(text, file, robot)


def slugsin_of(spec: Specification) -> bytes | None:
    """Return a specification in slugsin, translated by safenav's slugs; None without slugs."""
    done = _translated(spec.to_structuredslugs().encode())
    return done.stdout if done is not None and done.status == ExitStatus.REALIZABLE else None


def _translated(data: bytes) -> Finished | None:
    own = find_own_binary()
    if own is None:
        return None
    return ProcessGroup().run(own, _TRANSLATE, data, _TRANSLATION_SECONDS)


def _diagnostics(output: str, file: str, text: str) -> list[Diagnostic]:
    """Return the synthesizer's errors on standard error as diagnostics."""
    found: list[Diagnostic] = []
    lines = text.split("\n")
    hint = ""
    for line in reversed(output.splitlines()):  # a hint follows its error
        if error := _ERROR.fullmatch(line):
            row, column = int(error[1] or 0), int(error[2] or 0)
            source = lines[row - 1] if 0 < row <= len(lines) else ""
            found.append(Diagnostic(file, row, column, error[3], hint, source))
            hint = ""
        elif hinted := _HINT.fullmatch(line):
            hint = hinted[1]
    return found[::-1] or [Diagnostic(file, 0, 0, output.strip() or "not a specification")]
