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
from functools import cache, cached_property
from pathlib import Path
from typing import IO

from msgspec import Struct

from safenav.errors import ResourceLimitError, SynthesizerError

_ROUTINE = re.compile(r"RESULT: |SLUGS: |slugs \d+\.\d+")
_MOST_OUTPUT = 2 << 30
"""Bytes that a command may print where no memory limit is given."""
_PARENT = "SLUGS_PARENT"
"""Environment variable of safenav's synthesizer: the process that it must not outlive (Linux)."""


class Finished(Struct, frozen=True):
    """The result of a command. ``status`` is negative for death by that signal."""

    status: int
    stdout: bytes
    stderr: bytes
    seconds: float
    timed_out: bool

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
        binary: Binary,
        options: Sequence[str],
        given: bytes,
        seconds: float | None,
        memory_mb: int | None = None,
    ) -> Finished:
        """Run a binary with ``given`` on its standard input, at most ``seconds``. Its output is
        kept in memory, so ``memory_mb`` limits that also, and a foreign program as a whole.

        Raises SynthesizerError if it cannot be started, ResourceLimitError if its output is larger,
        and DismissedError after ``dismiss``.
        """
        begun = time.monotonic()
        most = _MOST_OUTPUT if memory_mb is None else memory_mb << 20
        foreign = memory_mb is not None and not binary.native
        with _file() as out, _file() as err:
            process = self._start(binary, options, out, err)
            timer = threading.Timer(seconds or 0, _kill, [process])
            timer.daemon = True
            try:
                _bound(process.pid, most, most if foreign else None)
                if seconds is not None:
                    timer.start()
                process.communicate(given)
            finally:
                timer.cancel()
                _kill(process)
                process.wait()
                with self._lock:
                    self._running.discard(process)
            if self._dismissed:
                raise DismissedError
            if max(file.seek(0, os.SEEK_END) for file in (out, err)) >= most:
                raise ResourceLimitError(
                    f"the synthesizer {binary.path} printed more than {most >> 20} MiB, the limit "
                    "of its memory (limits.synthesis_memory in the scenario); it was stopped"
                )
            out.seek(0)
            err.seek(0)
            printed = out.read(), err.read()
        took = time.monotonic() - begun
        late = process.returncode == -signal.SIGKILL and seconds is not None and took >= seconds
        return Finished(process.returncode, *printed, took, late)

    def dismiss(self) -> None:
        """Kill all running commands; refuse later ones."""
        with self._lock:
            self._dismissed = True
            for process in self._running:
                _kill(process)

    def _start(
        self, binary: Binary, options: Sequence[str], out: IO[bytes], err: IO[bytes]
    ) -> subprocess.Popen[bytes]:
        """Start the process. safenav's own program arranges itself to end with this thread: a
        wrapper would take as long as a small synthesis."""
        command = [str(binary.path), *options]
        with self._lock:
            if self._dismissed:
                raise DismissedError
            try:
                process = subprocess.Popen(
                    command if binary.ours else die_with_parent(command),
                    stdin=subprocess.PIPE,
                    stdout=out,
                    stderr=err,
                    start_new_session=True,
                    env={**os.environ, _PARENT: str(os.getpid())} if binary.ours else None,
                )
            except OSError as error:
                raise SynthesizerError(
                    f"the synthesizer {binary.path} cannot be started: {error.strerror}"
                ) from error
            self._running.add(process)
            return process


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Send SIGKILL to the process group that this process leads, unless the process has been reaped
    (its number may belong to another one by then)."""
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)


@contextlib.contextmanager
def orderly_termination() -> Iterator[None]:
    """Within this context, SIGTERM raises SystemExit instead of ending this process immediately, so
    that running commands are killed and reaped. An application's own handler stays."""

    def end(number: int, _: object) -> None:
        raise SystemExit(128 + number)

    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def die_with_parent(command: Sequence[str]) -> Sequence[str]:
    """Return ``command`` so that the kernel kills it when this process dies, even of SIGKILL
    (Linux; elsewhere it runs to its end)."""
    setpriv = _setpriv()
    if setpriv is None or not os.access(command[0], os.X_OK):
        return command  # a command that cannot be started raises its own error
    # This process may die before the kernel is asked: then the command must not begin.
    begin = ["/bin/sh", "-c", '[ "$PPID" = "$0" ] && exec "$@"', str(os.getpid())]
    return [setpriv, "--pdeathsig", "KILL", "--", *begin, *command]


@cache
def _setpriv() -> str | None:
    from shutil import which  # imported here: it loads the modules of all archives

    return which("setpriv") if sys.platform.startswith("linux") else None


def _file() -> IO[bytes]:
    """Return an empty file that is deleted after its use; in memory on Linux, which saves a
    millisecond of each synthesis."""
    if sys.platform == "linux":
        return os.fdopen(os.memfd_create("synthesizer"), "w+b")
    return tempfile.TemporaryFile()


def _bound(pid: int, output: int, memory: int | None) -> None:
    """Limit the bytes of each output of a process, and its address space (Linux)."""
    if sys.platform == "linux":
        from resource import RLIMIT_AS, RLIMIT_FSIZE, prlimit

        with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended
            prlimit(pid, RLIMIT_FSIZE, (output, output))
            if memory is not None:
                prlimit(pid, RLIMIT_AS, (memory, memory))


VARIABLE = "SAFENAV_SLUGS"
"""Environment variable that names another binary, for instance upstream's."""

_PACKAGE = Path(__file__).resolve().parent.parent
_INSIDE_PACKAGE = Path("_bin") / "slugs"
_NATIVE_VERSION = re.compile(rb"\Aslugs (\d+\.\d+\.\d+\S*)", re.MULTILINE)
_VERSION_SECONDS = 5.0


class Binary(Struct, frozen=True, dict=True):
    """A slugs binary. ``ours``: known to be safenav's, without a query."""

    path: Path
    ours: bool = False

    @cached_property
    def digest(self) -> str:
        """Hex sha256 of the file: cached results are valid for this program only. Raises
        SynthesizerError if it cannot be read."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        except OSError as error:
            raise SynthesizerError(
                f"the synthesizer {self.path} cannot be read: {error.strerror}"
            ) from error

    @property
    def native(self) -> bool:
        """Whether it is safenav's own slugs (else only upstream's options may be used)."""
        return self.ours or self.version is not None

    @cached_property
    def version(self) -> str | None:
        """The version that it prints; None if it has no such option, as upstream's binary."""
        try:
            answer = ProcessGroup().run(self, ["--version"], b"", _VERSION_SECONDS)
        except SynthesizerError:
            return None
        match = _NATIVE_VERSION.search(answer.stdout)
        return match[1].decode() if match and answer.status == 0 else None


def find_binary() -> Binary:
    """Return the binary to use: ``SAFENAV_SLUGS`` if set, else the one installed with safenav.

    Raises SynthesizerError, with advice, if none can be executed.
    """
    if named := os.environ.get(VARIABLE):
        return _named_by_environment(named)
    if own := find_own_binary():
        return own
    raise SynthesizerError(
        "the slugs binary is missing: safenav was installed without it and there is none at "
        "slugs/build/slugs\n"
        "    run `make slugs` in the repository or install again with `pip install .` (both "
        f"need a C++ compiler), or set {VARIABLE} to a slugs binary"
    )


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
