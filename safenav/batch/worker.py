"""Processes that run cases, one after another, and can be killed.

``run_case`` serves a batch: threads call it here, Dask workers elsewhere. A case that crashes or
hangs ends only its process.

A process has one connection, for cases and results; its output goes to a file. The process ends
with the connection, and so with the batch. The kernel then kills its synthesizer.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import queue
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from multiprocessing.connection import Connection, Pipe
from pathlib import Path

from msgspec.structs import replace

from safenav.batch.case import Case, CaseVerdict, Conditions, Result
from safenav.errors import SafenavError

_START_SECONDS = 60.0
_STACK_SECONDS = 2.0
"""Seconds in which a hung process must print its stack or an ended one kill its synthesis."""
_STACK = signal.SIGUSR1
"""The signal at which a process prints its stack."""
_LONGEST = 1e6
"""Maximum number of seconds that the system can wait for a result."""
_LAST_WORDS = 4000
_ROOT = str(Path(__file__).resolve().parents[2])
_PROGRAM = f"import sys; sys.path.append({_ROOT!r}); from safenav.batch.worker import main; main()"

_lock = threading.Lock()
_workers: dict[str, list[Worker]] = defaultdict(list)
"""Workers on this machine by batch, since several batches may share a cluster."""
_ended: set[str] = set()
"""Batches that get no further worker here: a thread may take a case while its batch ends."""


def run_case(batch: str, case: Case, conditions: Conditions) -> tuple[Result, bytes]:
    """Return the result of a case, and its trace if the case failed.

    Raises SafenavError if no process can start here or the batch has ended here.
    """
    with _lock:
        if batch in _ended:
            raise SafenavError("the batch has ended")
        worker = next((each for each in _workers[batch] if not each.case), None)
        if worker is None:
            _workers[batch].append(worker := Worker())
        worker.case, worker.since = case.name, time.monotonic()
    try:
        with tempfile.TemporaryDirectory(prefix="safenav-") as folder:
            trace = Path(folder) / "trace.jsonl"
            result = worker.run(case, conditions, trace)
            failed = trace.exists() and not result.passed
            return result, trace.read_bytes() if failed else b""
    except BaseException:
        worker.end()
        raise
    finally:
        with _lock:
            worker.case = ""
            if not worker.alive and worker in _workers[batch]:
                _workers[batch].remove(worker)


def running(batch: str) -> list[tuple[str, float]]:
    """Return a batch's running cases on this machine with their seconds so far."""
    with _lock:
        now = time.monotonic()
        return [(each.case, now - each.since) for each in _workers[batch] if each.case]


def leave(batch: str) -> None:
    """End all processes of a batch that has ended, so that none of its cases begins afterwards."""
    with _lock:
        _ended.add(batch)
        workers = _workers.pop(batch, [])
    for worker in workers:
        worker.send(signal.SIGTERM)
    for worker in workers:
        if worker.case:  # its thread closes the pipes: a close here would block that thread
            worker.kill()
        else:
            worker.end()


class Worker:
    """A process for many cases. One thread at a time may ``run`` a case.

    It has its own session: Ctrl-C at the terminal reaches the batch, which ends the process.
    """

    def __init__(self) -> None:
        self.case, self.since = "", time.monotonic()
        self._printed = tempfile.TemporaryFile()  # noqa: SIM115 (closed by `end`)
        self._ready = False
        self._connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=self._printed,
                stderr=self._printed,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        self.pid = self._process.pid

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def run(self, case: Case, conditions: Conditions, trace: Path) -> Result:
        """Return the result of a case, even if the case ends the process. ``trace``: the file for
        its trace. A worker that is then not ``alive`` cannot be used again.

        Raises SafenavError if the process does not start.
        """
        self._wait_until_ready()
        self.since = time.monotonic()
        before = self._size
        try:
            self._connection.send((case, conditions, trace))
            if self._connection.poll(min(conditions.seconds, _LONGEST)):
                result: Result = self._connection.recv()
                return replace(result, wall_seconds=self._seconds)
            self._print_stack()
            verdict = CaseVerdict.HUNG
            reason = f"stopped after {conditions.seconds:g} s (time limit)"
        except (EOFError, OSError):  # the process is dead
            verdict = CaseVerdict.CRASHED
            reason = f"the process that ran this case died: {self._death()}"
        self.kill()
        result = case.result(verdict, [reason], self._last_words(before))
        self.end()
        return replace(result, wall_seconds=self._seconds)

    @property
    def _seconds(self) -> float:
        """Seconds since the process received its case."""
        return round(time.monotonic() - self.since, 6)

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process and its group."""
        if self.alive:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)

    def kill(self) -> None:
        """Kill the process and its synthesizer."""
        for number, seconds in ((signal.SIGTERM, _STACK_SECONDS), (signal.SIGKILL, None)):
            self.send(number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(seconds)
                break

    def end(self) -> None:
        """Kill the process and its synthesizer, and close the files of the worker."""
        self.kill()
        self._connection.close()
        self._printed.close()

    def _wait_until_ready(self) -> None:
        """Wait until the process has started, without a charge to any case."""
        if self._ready:
            return
        problem = f"within {_START_SECONDS:.0f} s"
        try:
            if self._connection.poll(_START_SECONDS):
                self._ready = self._connection.recv()
                return
        except (EOFError, OSError):
            problem = f"({self._death()})\n{self._last_words(0)}"
        self.end()
        raise SafenavError(f"a worker process did not start {problem}")

    def _print_stack(self) -> None:
        """Let a hung process print its stack."""
        size, limit = self._size, time.monotonic() + _STACK_SECONDS
        self.send(_STACK)
        while self._size == size and self.alive and time.monotonic() < limit:
            time.sleep(0.01)

    @property
    def _size(self) -> int:
        """Number of bytes that the process has printed."""
        return os.fstat(self._printed.fileno()).st_size

    def _last_words(self, before: int) -> str:
        begin = max(before, self._size - _LAST_WORDS)
        # The process shares the offset of the file: do not move it.
        return (
            os.pread(self._printed.fileno(), _LAST_WORDS, begin).decode("utf-8", "replace").strip()
        )

    def _death(self) -> str:
        status = self._process.wait()
        if status >= 0:
            return f"exit status {status}"
        names = (each.name for each in signal.Signals if each == -status)
        return f"killed by {next(names, f'signal {-status}')}"


Task = tuple[Case, Conditions, Path]


def main() -> None:
    """The program of a worker: run cases until the connection ends."""
    connection = Connection(int(sys.argv[1]))
    faulthandler.enable()  # prints the stack after a crash
    faulthandler.register(_STACK)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    from safenav.batch.execution import execute

    tasks: queue.SimpleQueue[Task | None] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(connection, tasks), daemon=True).start()
    try:
        connection.send(True)  # this process is ready
        while task := tasks.get():
            case, conditions, trace = task
            with contextlib.suppress(OSError):  # else the case reports the missing files
                os.chdir(conditions.directory)
            connection.send(execute(case, conditions, trace))
    except BrokenPipeError:
        # The batch has ended. The interpreter would wait for the listening thread, then abort.
        os._exit(0)


def _listen(connection: Connection, tasks: queue.SimpleQueue[Task | None]) -> None:
    with contextlib.suppress(EOFError, OSError):
        while True:
            tasks.put(connection.recv())
    tasks.put(None)
    os.kill(os.getpid(), signal.SIGTERM)
