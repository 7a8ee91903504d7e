"""Selection and capabilities of the slugs binary.

safenav's and upstream's binary report a verdict by the same RESULT line. safenav's also reads
structured slugs, has ``--timeout`` and ``--memory``, and identifies itself by ``--version``.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from msgspec import Struct

from safenav.errors import SynthesizerError
from safenav.synthesis.process import ProcessGroup

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
