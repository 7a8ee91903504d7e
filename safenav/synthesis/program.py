"""The slugs binary, and its processes, none of which survives a timeout or Ctrl-C.

safenav's and upstream's binary report a verdict by the same RESULT line. safenav's also reads
structured slugs, has ``--timeout`` and ``--memory``, and identifies itself by ``--version``.

Each command has a process group of its own, which is killed and reaped at its deadline or when its
``ProcessGroup`` is dismissed. Commands run in threads, because signals interrupt only the main
thread: so no process is lost between its start and its registration. Their output goes to files in
memory, whose size the system limits.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from types import FrameType
from typing import IO

from msgspec import Struct

from safenav.errors import ResourceLimitError, SynthesizerError

_ROUTINE = re.compile(r"RESULT: |SLUGS: |slugs \d+\.\d+")
_MOST_OUTPUT = 2 << 30
"""Bytes that a command may print where no memory limit is given."""
_PARENT = "SLUGS_PARENT"
"""Environment variable of safenav's synthesizer: the process that it must not outlive (Linux)."""
OVERTIME_SECONDS = 1.0
"""safenav's own binary keeps the time limit and reports its progress; this long after the limit it
is killed."""


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
        *,
        own: bool = False,
        foreign: bool = False,
    ) -> Finished:
        """Run ``command`` with ``given`` on its standard input, at most ``seconds``. Its output is
        kept in memory, so ``memory_mb`` limits that also. ``own``: safenav's own program,
        which arranges to end with this thread itself: a wrapper would take as long as a small
        synthesis. ``foreign``: it has no memory limit itself.

        Raises SynthesizerError if it cannot be started, ResourceLimitError if its output is larger,
        and DismissedError after ``dismiss``.
        """
        begun, late = time.monotonic(), threading.Event()
        most = _MOST_OUTPUT if memory_mb is None else memory_mb << 20
        with _file() as out, _file() as err:
            words = command if own else die_with_parent(command, memory_mb if foreign else None)
            process = self._start(words, own, out, err)

            def end() -> None:
                late.set()
                kill_group(process)

            timer = threading.Timer(seconds or 0, end)
            timer.daemon = True
            try:
                _bound(process.pid, most, memory_mb if foreign else None)
                if seconds is not None:
                    timer.start()
                process.communicate(given)
            finally:
                timer.cancel()
                kill_group(process)
                process.wait()
                with self._lock:
                    self._running.discard(process)
            if self._dismissed:
                raise DismissedError
            if max(file.seek(0, os.SEEK_END) for file in (out, err)) >= most:
                raise ResourceLimitError(
                    f"the synthesizer {command[0]} printed more than {most >> 20} MiB, the limit "
                    "of its memory (limits.synthesis_memory in the scenario); it was stopped"
                )
            out.seek(0)
            err.seek(0)
            printed = out.read(), err.read()
        killed = late.is_set() and process.returncode == -signal.SIGKILL
        seconds = time.monotonic() - begun
        return Finished(process.returncode, printed[0], printed[1], seconds, killed)

    def dismiss(self) -> None:
        """Kill all running commands; refuse later ones."""
        with self._lock:
            self._dismissed = True
            for process in self._running:
                kill_group(process)

    def _start(
        self, command: Sequence[str], own: bool, out: IO[bytes], err: IO[bytes]
    ) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._dismissed:
                raise DismissedError
            try:
                process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=out,
                    stderr=err,
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


def _exit_as_terminated(signum: int, _frame: FrameType | None) -> None:
    raise SystemExit(128 + signum)


def die_with_parent(command: Sequence[str], memory_mb: int | None = None) -> list[str]:
    """Return ``command`` so that the kernel kills it when this process dies, even of SIGKILL, and
    limits its address space from its beginning (Linux; elsewhere it runs to its end)."""
    setpriv = _setpriv()
    if setpriv is None or not os.access(command[0], os.X_OK):
        return list(command)  # a command that cannot be started raises its own error
    # This process may die before the kernel is asked: then the command must not begin.
    limit = "" if memory_mb is None else f"ulimit -v {memory_mb << 10} && "
    begin = ["/bin/sh", "-c", f'[ "$PPID" = "$0" ] && {limit}exec "$@"', str(os.getpid())]
    return [setpriv, "--pdeathsig", "KILL", "--", *begin, *command]


@lru_cache(maxsize=1)
def _setpriv() -> str | None:
    from shutil import which  # imported here: it loads the modules of all archives

    return which("setpriv") if sys.platform.startswith("linux") else None


def _file() -> IO[bytes]:
    """Return an empty file that ends with its use; in memory on Linux, which saves a millisecond
    of each synthesis."""
    if sys.platform == "linux":
        return os.fdopen(os.memfd_create("synthesizer"), "w+b")
    return tempfile.TemporaryFile()


def _bound(pid: int, output: int, memory_mb: int | None) -> None:
    """Limit the bytes of each output of a process, and its address space (Linux)."""
    if sys.platform == "linux":
        from resource import RLIMIT_AS, RLIMIT_FSIZE, prlimit

        with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended
            prlimit(pid, RLIMIT_FSIZE, (output, output))
            if memory_mb is not None:
                prlimit(pid, RLIMIT_AS, (memory_mb << 20, memory_mb << 20))


VARIABLE = "SAFENAV_SLUGS"
"""Environment variable that names another binary, for instance upstream's."""

_PACKAGE = Path(__file__).resolve().parent.parent
_INSIDE_PACKAGE = Path("_bin") / "slugs"
_NATIVE_VERSION = re.compile(r"\Aslugs (\d+\.\d+\.\d+\S*)", re.MULTILINE)
_VERSION_SECONDS = 5.0


class Binary(Struct, frozen=True):
    """A slugs binary. ``ours``: known to be safenav's, without a query."""

    path: Path
    ours: bool = False

    @property
    def digest(self) -> str:
        """Hex sha256 of the file: cached results are valid for this program only. Raises
        SynthesizerError if it cannot be read."""
        try:
            return _digest(self.path, _version_of(self.path))
        except OSError as error:
            raise SynthesizerError(
                f"the synthesizer {self.path} cannot be read: {error.strerror}"
            ) from error

    @property
    def native(self) -> bool:
        """Whether it is safenav's own slugs (else only upstream's options may be used)."""
        return self.ours or self.version is not None

    @property
    def version(self) -> str | None:
        """The version that it prints, None if it has no such option."""
        try:
            return _ask_version(self.path, _version_of(self.path))
        except OSError:
            return None


def find_binary() -> Binary:
    """Return the binary to use: ``SAFENAV_SLUGS`` if set, else the one installed with safenav.

    Raises SynthesizerError, with advice, if none can be executed.
    """
    named = os.environ.get(VARIABLE)
    if named:
        return _named_by_environment(named)
    own = find_own_binary()
    if own is None:
        raise SynthesizerError(
            "the slugs binary is missing: safenav was installed without it and there is none at "
            "slugs/build/slugs\n"
            "    run `make slugs` in the repository or install again with `pip install .` (both "
            f"need a C++ compiler), or set {VARIABLE} to a slugs binary"
        )
    return own


def find_own_binary() -> Binary | None:
    """Return safenav's own binary: in the installed package, else built in the source tree."""
    found = (Binary(place, ours=True) for place in _own_places() if _executable(place))
    return next(found, None)


def _own_places() -> Iterator[Path]:
    yield _PACKAGE / _INSIDE_PACKAGE
    # Imported here, since it is slow: it reads Python's build configuration.
    import sysconfig

    for scheme in ("platlib", "purelib"):
        yield Path(sysconfig.get_path(scheme)) / _PACKAGE.name / _INSIDE_PACKAGE
    yield _PACKAGE.parent / "slugs" / "build" / "slugs"


def _named_by_environment(named: str) -> Binary:
    from shutil import which  # imported here: it loads the modules of all archives

    on_path = None if os.sep in named else which(named)
    path = Path(on_path or named).expanduser()
    if _executable(path):
        return Binary(path.resolve())
    problem = "is not executable" if path.exists() else "does not exist"
    raise SynthesizerError(
        f"the synthesizer {named!r} {'is a directory' if path.is_dir() else problem}\n"
        f"    fix or unset {VARIABLE}, which selects this binary"
    )


def _executable(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


def _version_of(path: Path) -> tuple[int, ...]:
    """Inode, time and size of a file, of which a new one has others. Raises OSError."""
    status = path.stat()
    return status.st_ino, status.st_mtime_ns, status.st_size


@lru_cache(maxsize=64)
def _digest(path: Path, _of: tuple[int, ...]) -> str:
    """Hash once per file content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@lru_cache(maxsize=64)
def _ask_version(path: Path, _of: tuple[int, ...]) -> str | None:
    """Query once per file content; upstream's binary rejects ``--version``."""
    try:
        answer = ProcessGroup().run([str(path), "--version"], b"", _VERSION_SECONDS)
    except SynthesizerError:
        return None
    if answer.status != 0:
        return None
    match = _NATIVE_VERSION.search(answer.stdout.decode("utf-8", "replace"))
    return match.group(1) if match else None
