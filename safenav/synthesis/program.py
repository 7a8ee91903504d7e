"""The slugs binary and its processes. None survives a timeout, Ctrl-C or (on Linux) the death of
this process.

Each command has its own process group, which is killed and reaped at the deadline or when its
``ProcessGroup`` is dismissed. Commands run in threads: signals interrupt only the main thread, so
no process is lost between its start and registration. Their output goes to in-memory files, whose
size the system limits.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING

from msgspec import Struct

from safenav.errors import ResourceLimitError, SynthesizerError

if TYPE_CHECKING:
    import subprocess

_ROUTINE = re.compile(r"RESULT: |SLUGS: |slugs \d+\.\d+")
_MOST_OUTPUT = 2 << 30
"""Maximum bytes that a command may print if there is no memory limit."""
_PARENT = "SLUGS_PARENT"
"""Environment variable of slugs: the process with which it must end (Linux). A wrapper process for
this purpose would take as long as a small synthesis."""


class Finished(Struct, frozen=True):
    """The result of a command. A negative ``status`` is the signal that killed the command."""

    status: int
    stdout: bytes
    stderr: bytes
    seconds: float
    timed_out: bool

    @property
    def explanation(self) -> str:
        """The last lines of standard error, without the banner and the verdict."""
        lines = map(str.rstrip, self.stderr.decode("utf-8", "replace").splitlines())
        return "\n".join([e for e in lines if e and not _ROUTINE.match(e)][-12:])[-2000:]


class DismissedError(Exception):
    """A command that was killed because its result is no longer needed."""


class ProcessGroup:
    """The running commands of one call. Its methods may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._dismissed = False

    def run(
        self,
        binary: Path,
        options: Sequence[str],
        given: bytes,
        seconds: float | None,
        memory_mb: int | None = None,
    ) -> Finished:
        """Run a binary with ``given`` on its standard input, for at most ``seconds``. Its output
        stays in memory, so ``memory_mb`` also limits the output.

        Raises SynthesizerError if it cannot be started, ResourceLimitError if its output is larger,
        and DismissedError after ``dismiss``.
        """
        begun = time.monotonic()
        most = _MOST_OUTPUT if memory_mb is None else memory_mb << 20
        with _file() as out, _file() as err:
            process = self._start(binary, options, out, err)
            timer = threading.Timer(seconds or 0, _kill, [process])
            timer.daemon = True
            try:
                _bound(process.pid, most)
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
                    f"the synthesizer {binary} printed more than {most >> 20} MiB, the limit "
                    "of its memory (limits.synthesis_memory in the scenario); it was stopped"
                )
            out.seek(0)
            err.seek(0)
            printed = out.read(), err.read()
        took = time.monotonic() - begun
        late = process.returncode == -signal.SIGKILL and seconds is not None and took >= seconds
        return Finished(process.returncode, *printed, took, late)

    def dismiss(self) -> None:
        """Kill all running commands and refuse further ones."""
        with self._lock:
            self._dismissed = True
            for process in self._running:
                _kill(process)

    def _start(
        self, binary: Path, options: Sequence[str], out: IO[bytes], err: IO[bytes]
    ) -> subprocess.Popen[bytes]:
        import subprocess  # most results come from the cache

        with self._lock:
            if self._dismissed:
                raise DismissedError
            try:
                process = subprocess.Popen(
                    [str(binary), *options],
                    stdin=subprocess.PIPE,
                    stdout=out,
                    stderr=err,
                    start_new_session=True,
                    env={**os.environ, _PARENT: str(os.getpid())},
                )
            except OSError as error:
                raise SynthesizerError(
                    f"the synthesizer {binary} cannot be started: {error.strerror}"
                ) from error
            self._running.add(process)
            return process


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Send SIGKILL to the process group of a process, unless the process has been reaped (another
    process may then have its id)."""
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)


def _file() -> IO[bytes]:
    """Return an empty file that is deleted after use. On Linux it is in memory, which saves a
    millisecond in each synthesis."""
    if sys.platform == "linux":
        return os.fdopen(os.memfd_create("synthesizer"), "w+b")
    from tempfile import TemporaryFile

    return TemporaryFile()


def _bound(pid: int, output: int) -> None:
    """Limit the size of each output file of a process, in bytes (Linux only)."""
    if sys.platform == "linux":
        from resource import RLIMIT_FSIZE, prlimit

        with contextlib.suppress(ProcessLookupError, PermissionError):  # the process has ended
            prlimit(pid, RLIMIT_FSIZE, (output, output))


VARIABLE = "SAFENAV_SLUGS"
"""Environment variable: the path of another build of slugs."""

_PACKAGE = Path(__file__).resolve().parent.parent
_INSIDE_PACKAGE = Path("_bin") / "slugs"


def find_binary() -> Path:
    """Return the binary to use: ``SAFENAV_SLUGS`` if set, else safenav's own.

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


def find_own_binary() -> Path | None:
    """Return safenav's own binary, in the installed package or else built in the source tree; None
    if there is none."""
    usable = (place for place in _own_places() if place.is_file() and os.access(place, os.X_OK))
    return next(usable, None)


def _own_places() -> Iterator[Path]:
    yield _PACKAGE / _INSIDE_PACKAGE
    # Imported here since it is slow: it reads Python's build configuration.
    import sysconfig

    for scheme in ("platlib", "purelib"):
        yield Path(sysconfig.get_path(scheme)) / _PACKAGE.name / _INSIDE_PACKAGE
    yield _PACKAGE.parent / "slugs" / "build" / "slugs"


def _named_by_environment(named: str) -> Path:
    from shutil import which  # imported here: it loads the modules of all archives

    if found := which(named):
        return Path(found).resolve()
    path = Path(named)
    problem = "is not executable" if path.exists() else "does not exist"
    raise SynthesizerError(
        f"the synthesizer {named!r} {'is a directory' if path.is_dir() else problem}\n"
        f"    fix or unset {VARIABLE}, which selects this binary"
    )
