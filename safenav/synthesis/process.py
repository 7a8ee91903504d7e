"""Processes of the synthesizer, none of which survives a timeout or Ctrl-C.

Each command has a process group of its own, which is killed and reaped at its deadline or when its
``ProcessGroup`` is dismissed. Commands run in threads, because signals interrupt only the main
thread: so no process is lost between its start and its registration.
"""

from __future__ import annotations

import contextlib
import os
import re
import selectors
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from functools import lru_cache
from types import FrameType

from msgspec import Struct

from safenav.errors import ResourceLimitError, SynthesizerError

_ROUTINE = re.compile(r"RESULT: |SLUGS: |slugs \d+\.\d+")
_CHUNK = 1 << 16
_MOST_OUTPUT = 2 << 30
"""Bytes that a command may print where no memory limit is given."""
_PARENT = "SLUGS_PARENT"
"""Environment variable of safenav's synthesizer: the process that it must not outlive."""
OVERTIME_SECONDS = 1.0
"""safenav's own binary keeps the time limit and reports its progress; this long after the limit it
is killed."""
_GRACE_SECONDS = 2.0
"""Limit for draining the pipes of a killed group, which a stray grandchild may still hold."""


class Finished(Struct, frozen=True):
    """The result of a command. ``status`` is negative for death by that signal."""

    status: int
    stdout: bytes
    stderr: bytes
    seconds: float
    timed_out: bool = False

    @property
    def last_words(self) -> str:
        """The last lines of its standard error, for messages."""
        text = self.stderr.decode("utf-8", "replace").strip()
        lines = [line.rstrip() for line in text.splitlines() if line.strip()]
        return "\n".join(lines[-12:])[-2000:]

    @property
    def explanation(self) -> str:
        """``last_words`` without the banner and the verdict."""
        lines = self.last_words.splitlines()
        return "\n".join(line for line in lines if not _ROUTINE.match(line))


class DismissedError(Exception):
    """The command was killed because its result is no longer needed."""


class ProcessGroup:
    """The running commands of one call. Thread safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._dismissed = False

    def run(
        self,
        command: Sequence[str],
        given: bytes,
        seconds: float | None,
        memory_mb: int | None = None,
        own: bool = False,
    ) -> Finished:
        """Run ``command`` with ``given`` on its standard input, at most ``seconds``. Its output is
        kept in memory, so ``memory_mb`` limits that also. ``own``: as in ``start``.

        Raises SynthesizerError if it cannot be started, ResourceLimitError if its standard output
        is larger (SynthesizerError: its standard error), and DismissedError after ``dismiss``.
        """
        begun = time.monotonic()
        process = self.start(command, own=own)
        try:
            deadline = None if seconds is None else begun + seconds
            most = _MOST_OUTPUT if memory_mb is None else memory_mb << 20
            talk = _Conversation(process, given, deadline, most)
            finished = talk.until_silence() and _exits(process, talk.deadline)
            if not finished:
                kill_group(process)
                talk.drain(time.monotonic() + _GRACE_SECONDS)
        finally:
            self.end(process)
        if self._dismissed:
            raise DismissedError
        elapsed = time.monotonic() - begun
        return Finished(process.returncode, talk.stdout, talk.stderr, elapsed, not finished)

    def dismiss(self) -> None:
        """Kill all running commands; refuse later ones."""
        with self._lock:
            self._dismissed = True
            for process in self._running:
                kill_group(process)

    def end(self, process: subprocess.Popen[bytes]) -> None:
        """Kill a process with its group, close its pipes and reap it."""
        kill_group(process)
        for pipe in (process.stdin, process.stdout, process.stderr):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        process.wait()
        with self._lock:
            self._running.discard(process)

    def start(self, command: Sequence[str], own: bool = False) -> subprocess.Popen[bytes]:
        """Start ``command``, which ends when this thread does (on Linux). ``own``: safenav's own
        program, which arranges its end itself; a wrapper would take as long as a small synthesis.
        Raises as ``run`` does."""
        with self._lock:
            if self._dismissed:
                raise DismissedError
            try:
                process = subprocess.Popen(
                    command if own else die_with_parent(command),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    bufsize=0,
                    start_new_session=True,
                    env={**os.environ, _PARENT: str(os.getpid())} if own else None,
                )
            except OSError as error:
                raise SynthesizerError(
                    f"the synthesizer {command[0]} cannot be started: {error.strerror}"
                ) from error
            self._running.add(process)
            return process


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """Send SIGKILL to the process group that this process leads, unless the process has been reaped
    (its number may belong to another one by then)."""
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)


@contextlib.contextmanager
def orderly_termination() -> Iterator[None]:
    """Within this context, SIGTERM raises SystemExit instead of ending this process immediately, so
    that running commands are killed and reaped. An application's own handler stays."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
    ):
        yield
        return
    signal.signal(signal.SIGTERM, _exit_as_terminated)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@lru_cache(maxsize=1)
def _setpriv() -> str | None:
    from shutil import which  # imported here: it loads the modules of all archives

    return which("setpriv") if sys.platform.startswith("linux") else None


def die_with_parent(command: Sequence[str]) -> list[str]:
    """Return ``command`` so that the kernel kills it when this process dies, even of SIGKILL
    (Linux; elsewhere it runs to its end)."""
    setpriv = _setpriv()
    if setpriv is None or not os.access(command[0], os.X_OK):
        return list(command)  # a command that cannot be started raises its own error
    return [setpriv, "--pdeathsig", "KILL", "--", *command]


def limits(seconds: float | None, memory_mb: int | None) -> list[str]:
    """Return the options by which safenav's own program keeps limits."""
    time_limit = [] if seconds is None else ["--timeout", f"{seconds:g}"]
    return [*time_limit, *([] if memory_mb is None else ["--memory", str(memory_mb)])]


def limited(command: Sequence[str], memory_mb: int | None) -> list[str]:
    """Return ``command`` under a limit on its address space, for programs with no such option.

    The shell sets the limit and becomes the command, so there is no moment without it.
    """
    if memory_mb is None or not sys.platform.startswith("linux"):
        return list(command)
    return ["/bin/sh", "-c", 'ulimit -v "$0" && exec "$@"', str(memory_mb * 1024), *command]


class _Conversation:
    """Feeds a process and reads both its outputs concurrently, up to a deadline and a size.

    ``Popen.communicate`` would suffice, but does not bound the output of a program.
    """

    def __init__(
        self, process: subprocess.Popen[bytes], given: bytes, deadline: float | None, most: int
    ) -> None:
        assert process.stdin and process.stdout and process.stderr
        self.deadline = deadline
        self._most = most
        words = process.args if isinstance(process.args, list) else [process.args]
        self._command = str(words[words.index("--") + 1] if "--" in words else words[0])
        self._given = memoryview(given)
        self._heard: dict[int, list[bytes]] = {1: [], 2: []}
        self._size = 0
        self._selector = selectors.DefaultSelector()
        self._stdin = process.stdin
        os.set_blocking(process.stdin.fileno(), False)
        self._selector.register(process.stdin, selectors.EVENT_WRITE, 0)
        self._selector.register(process.stdout, selectors.EVENT_READ, 1)
        self._selector.register(process.stderr, selectors.EVENT_READ, 2)

    @property
    def stdout(self) -> bytes:
        return b"".join(self._heard[1])

    @property
    def stderr(self) -> bytes:
        return b"".join(self._heard[2])

    def until_silence(self) -> bool:
        """Return whether both outputs were closed before the deadline."""
        while self._selector.get_map():
            left = None if self.deadline is None else self.deadline - time.monotonic()
            if left is not None and left <= 0:
                return False
            for key, _ in self._selector.select(left):
                if key.data == 0:
                    self._feed()
                else:
                    self._hear(key)
        self._selector.close()
        return True

    def drain(self, deadline: float) -> None:
        """Read the remaining output of a killed process."""
        self.deadline = deadline
        self.until_silence()
        self._selector.close()

    def _feed(self) -> None:
        try:
            written = os.write(self._stdin.fileno(), self._given[:_CHUNK])
        except BlockingIOError:
            return
        except BrokenPipeError:  # it reads no more; its exit status shows a crash
            written = len(self._given)
        self._given = self._given[written:]
        if not self._given:
            self._selector.unregister(self._stdin)
            self._stdin.close()

    def _hear(self, key: selectors.SelectorKey) -> None:
        data = os.read(key.fd, _CHUNK)
        if not data:
            self._selector.unregister(key.fileobj)
            return
        self._heard[key.data].append(data)
        self._size += len(data)
        if self._size > self._most:
            # Standard output may hold a strategy as large; messages never are.
            kind = ResourceLimitError if key.data == 1 else SynthesizerError
            raise kind(
                f"the synthesizer {self._command} printed more than {self._most >> 20} MiB, the "
                "limit of its memory (limits.synthesis_memory in the scenario); it was stopped"
            )


def _exits(process: subprocess.Popen[bytes], deadline: float | None) -> bool:
    """Return whether a process that has closed its outputs also ends by the deadline."""
    try:
        process.wait(None if deadline is None else max(0.01, deadline - time.monotonic()))
    except subprocess.TimeoutExpired:
        return False
    return True


def _exit_as_terminated(signum: int, _frame: FrameType | None) -> None:
    raise SystemExit(128 + signum)
