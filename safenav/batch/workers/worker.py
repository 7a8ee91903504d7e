"""A worker process: give it a case, wait for the result, or end it.

It is killed with all its descendants, including synthesizers, which lead their own process groups
and outlive a crashed worker. On Linux descendants are recognized by a mark in their environment,
which they inherit and keep when orphaned; elsewhere by the process tree, which must be read before
the worker dies.
"""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterable
from pathlib import Path

from msgspec import convert, to_builtins
from msgspec.structs import replace

from safenav.batch.cases.case import Case, CaseVerdict, Conditions, Result, without_a_run
from safenav.batch.workers.case_process import READY
from safenav.errors import SafenavError
from safenav.lines import json_line

MARK = "SAFENAV_BATCH_WORKER"
"""Environment variable: a different value for each worker."""

_ROUNDS = 50
"""Maximum number of searches: during one, a process may start another or not have its environment
yet."""
_BEGINNING_SECONDS = 0.01
_YOUNG_SECONDS = 5.0


def kill_family(pid: int, mark: str) -> None:
    """Send SIGKILL to a child of this process (not yet reaped) and to its descendants."""
    if not sys.platform.startswith("linux"):
        for descendant in _descendants(pid):
            _kill(descendant)
        _kill(pid)
        return
    _kill(pid)
    kill_orphans(mark)


def kill_orphans(mark: str) -> None:
    """Send SIGKILL to all processes with the mark; to none where environments cannot be read."""
    wanted = f"{MARK}={mark}".encode()
    for _ in range(_ROUNDS):
        seen = [(pid, _environment(pid)) for pid in _processes()]
        found = [pid for pid, environment in seen if wanted in environment.split(b"\0")]
        for pid in found:
            _kill(pid)
        beginning = [pid for pid, environment in seen if not environment and _begins(pid)]
        if not found and not beginning:
            return
        if beginning:
            time.sleep(_BEGINNING_SECONDS)


def _processes() -> list[int]:
    with contextlib.suppress(OSError):
        return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdecimal()]
    return []


def _environment(pid: int) -> bytes:
    """Return the environment of a process; empty if it is dead, of another user or just
    starting."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/environ").read_bytes()
    return b""


def _begins(pid: int) -> bool:
    """Return whether a process without an environment has just been started and may still get
    one."""
    with contextlib.suppress(OSError, ValueError):
        Path(f"/proc/{pid}/exe").readlink()  # fails for dead processes and kernel threads
        since = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
        age = time.clock_gettime(time.CLOCK_BOOTTIME) - since / os.sysconf("SC_CLK_TCK")
        return age < _YOUNG_SECONDS
    return False


def _descendants(pid: int) -> list[int]:
    listing = subprocess.run(
        ["ps", "-A", "-o", "pid=,ppid="], capture_output=True, text=True, check=False
    ).stdout
    children: dict[int, list[int]] = {}
    for line in listing.splitlines():
        child, parent = (int(word) for word in line.split())
        children.setdefault(parent, []).append(child)
    found, todo = [], [pid]
    while todo:
        below = children.get(todo.pop(), [])
        found += below
        todo += below
    return found


def _kill(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(pid, signal.SIGKILL)


_START_SECONDS = 60.0
_LAST_WORDS = 4000
_STACK_SECONDS = 0.5
"""Seconds for a hung worker to print its stack before it is killed."""

_ROOT = str(Path(__file__).resolve().parents[3])
_PROGRAM = (
    f"import sys; sys.path.append({_ROOT!r}); "
    "from safenav.batch.workers.case_process import main; main()"
)


class Worker:
    """One process, used for many cases. Not thread safe.

    It has a session of its own: Ctrl-C at the terminal reaches only the batch, which then ends its
    workers.
    """

    def __init__(self) -> None:
        self._mark = uuid.uuid4().hex
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 (closed by `end`)
        self._words_before = 0
        self._heard = b""
        self._ready = False
        self._limit = _START_SECONDS
        self.case: Case | None = None
        self._since = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            env={**os.environ, MARK: self._mark},
            start_new_session=True,
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    def fileno(self) -> int:
        """Return the file descriptor that is readable when there may be a result."""
        assert self._process.stdout is not None
        return self._process.stdout.fileno()

    @property
    def elapsed(self) -> float:
        """Seconds since the case was given (its start-up does not count)."""
        return time.monotonic() - self._since

    @property
    def seconds_left(self) -> float:
        """Return the time left until this worker counts as hung."""
        return (self._limit if self._ready else _START_SECONDS) - self.elapsed

    def give(
        self, case: Case, conditions: Conditions, trace: Path | None, directory: str | None = None
    ) -> None:
        """Start a case; the worker must be idle. ``directory``: the one to which paths in the case
        are relative, if not the one where the worker was started."""
        assert self.case is None and self._process.stdin is not None
        self.case = case
        self._limit = conditions.seconds
        self._since = time.monotonic()
        self._words_before = os.fstat(self._stderr.fileno()).st_size
        task = {
            "case": to_builtins(case),
            "conditions": to_builtins(conditions),
            "directory": directory,
            "trace": None if trace is None else str(trace.resolve()),
        }
        with contextlib.suppress(BrokenPipeError):  # it is dead, which ``receive`` reports
            self._process.stdin.write(json_line(task).encode())
            self._process.stdin.flush()

    def receive(self) -> Result | None:
        """Return the result of the case, when ``fileno`` is readable or the time is over; None if
        the case still runs. A worker that is not ``alive`` afterwards cannot be used again.

        Raises SafenavError if the process does not start.
        """
        if with_news([self], 0):
            return self._read()
        return self._hung() if self.seconds_left <= 0 else None

    @property
    def alive(self) -> bool:
        return self._process.returncode is None

    def wait(self) -> Result:
        """Wait for the result of the case and return it."""
        while True:
            with_news([self], max(0.0, self.seconds_left))
            if result := self.receive():
                return result

    def kill(self) -> None:
        """Kill the process and its descendants; may be called from another thread."""
        kill_family(self.pid, self._mark)

    def end(self) -> None:
        """Kill the process and its descendants, and close its pipes."""
        if self.alive:
            self.kill()
            self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._stderr):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()

    def _read(self) -> Result | None:
        data = os.read(self.fileno(), 1 << 16)
        if not data:
            return self._crashed()
        self._heard += data
        ready = json_line(READY).encode()
        if not self._ready and self._heard.startswith(ready):
            self._ready = True
            self._heard = self._heard[len(ready) :]
            self._since = time.monotonic()
        if not self._heard.endswith(b"\n"):
            return None
        answer, self._heard, self.case = self._heard, b"", None
        return self._timed(convert(json.loads(answer), Result))

    def _crashed(self) -> Result:
        status = self._process.wait()
        kill_orphans(self._mark)
        if not self._ready:
            words = self._last_words()
            self.end()
            raise SafenavError(f"a worker process does not start ({_death(status)})\n{words}")
        return self._ended(CaseVerdict.CRASHED, f"the process that ran it died: {_death(status)}")

    def _hung(self) -> Result:
        if not self._ready:
            self.end()
            raise SafenavError(f"a worker process does not start within {_START_SECONDS:.0f} s")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.send_signal(signal.SIGABRT)
            self._process.wait(_STACK_SECONDS)
        if self.alive:
            self.kill()
            self._process.wait()
        else:
            kill_orphans(self._mark)
        return self._ended(CaseVerdict.HUNG, f"stopped after {self._limit:g} s (time limit)")

    def _ended(self, verdict: CaseVerdict, reason: str) -> Result:
        """Return the result of a case whose process has died."""
        assert self.case is not None
        result = without_a_run(self.case, verdict, [reason], self._last_words())
        self.end()
        return self._timed(result)

    def _timed(self, result: Result) -> Result:
        """Return a result with its wall time: as measured by its process, or here if that is
        longer."""
        return replace(result, wall_seconds=max(result.wall_seconds, round(self.elapsed, 6)))

    def _last_words(self) -> str:
        file = self._stderr.fileno()  # its offset is shared with the process: do not move it
        begin = max(self._words_before, os.fstat(file).st_size - _LAST_WORDS)
        return os.pread(file, _LAST_WORDS, begin).decode("utf-8", "replace").strip()


def with_news(workers: Iterable[Worker], seconds: float) -> list[Worker]:
    """Return the workers that have a message or are dead; wait up to ``seconds`` for the first."""
    with selectors.DefaultSelector() as selector:
        for worker in workers:
            selector.register(worker, selectors.EVENT_READ, worker)
        return [key.data for key, _ in selector.select(seconds)]


def _death(status: int) -> str:
    if status >= 0:
        return f"exit status {status}"
    with contextlib.suppress(ValueError):
        return f"killed by {signal.Signals(-status).name}"
    return f"killed by signal {-status}"
