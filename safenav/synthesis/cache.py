"""The synthesizer's results, stored on disk under a key of their inputs.

The key is a hash of the specification without comments, the binary's content and the options. Each
file has a checksum of its name and content, appears by renaming and never changes. So any number of
processes can read and write without a lock. An error costs a recomputation, never a run: damaged
files are replaced, and an unwritable disk is reported once.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import warnings
from collections.abc import Iterable
from pathlib import Path
from random import random

from msgspec import Struct, msgpack

from safenav.errors import Verdict

VARIABLE = "SAFENAV_CACHE"
"""Environment variable: the directory, or ``off``."""

_OFF = "off"
_MAGIC = "safenav-cache 3 "
"""First bytes of an entry; the number changes with ``CacheEntry``."""
_RESULT, _TEXT = ".answer", ".structuredslugs"
_LIMIT_BYTES = 512 << 20
_LISTINGS = 64
"""Average number of directory listings per size limit of written data."""


class CacheWarning(UserWarning):
    """A cache that cannot be used. All functions still work, only more slowly."""


class CacheEntry(Struct, frozen=True):
    """A proven verdict, the cost of its synthesis, and the strategy if there is one."""

    verdict: Verdict
    seconds: float
    strategy_json: bytes | None


def key_of(text: str, binary_digest: str, options: Iterable[str]) -> str:
    """Return the key of a result, in hex. Each part is hashed with its length, so different lists
    of parts give different texts."""
    whole = hashlib.sha256()
    for part in (text, binary_digest, *options):
        data = part.encode()
        whole.update(len(data).to_bytes(8, "big"))
        whole.update(data)
    return whole.hexdigest()


class Cache:
    """A directory of results. Without a directory, the cache only keeps texts, in memory."""

    def __init__(self, directory: Path | None, limit_bytes: int = _LIMIT_BYTES) -> None:
        self.directory = directory
        self._limit_bytes = limit_bytes
        self._texts: dict[str, str] = {}
        self._warned = False

    @classmethod
    def from_environment(cls) -> Cache:
        """Return the cache in ``SAFENAV_CACHE`` (a directory or ``off``) or the user's cache."""
        named, base = os.environ.get(VARIABLE), os.environ.get("XDG_CACHE_HOME", "")
        try:
            if named:
                return cls(None if named.lower() == _OFF else Path(named).expanduser())
            # The XDG standard ignores relative paths.
            user = Path(base) if Path(base).is_absolute() else Path.home() / ".cache"
            return cls(user / "safenav")
        except RuntimeError:  # no home directory: a container with an unknown user
            return cls(None)

    def load(self, key: str) -> CacheEntry | None:
        """Return the result with a key; None if it is unknown or its file is damaged."""
        data = self._read(key + _RESULT)
        return None if data is None else msgpack.decode(data, type=CacheEntry)

    def store(self, key: str, entry: CacheEntry) -> None:
        """Store a proven verdict. An exhausted limit proves nothing and is not stored."""
        if entry.verdict.proven:
            self._write(key + _RESULT, msgpack.encode(entry))

    def keep_text(self, sha256: str, text: str) -> None:
        """Keep the text of a specification under its sha256, by which traces name it. Keep it also
        in memory, since bundles need it even without a writable directory. Replace a damaged file
        with this name, or one of another version."""
        self._texts[sha256] = text
        if self._read(sha256 + _TEXT) is None:
            self._write(sha256 + _TEXT, text.encode())

    def load_text(self, sha256: str) -> str | None:
        """Return the text with a sha256; None if the cache lacks it."""
        data = self._read(sha256 + _TEXT)
        return self._texts.get(sha256) if data is None else data.decode()

    def _path(self, name: str) -> Path:
        assert self.directory is not None
        return self.directory / name[:2] / name

    def _read(self, name: str) -> bytes | None:
        """Return the entry in a file; None if the file is damaged and must be replaced."""
        if self.directory is None:
            return None
        try:
            first, _, body = self._path(name).read_bytes().partition(b"\n")
        except OSError:
            return None
        return body if first == _first_line(name, body) else None

    def _write(self, name: str, body: bytes) -> None:
        if self.directory is None:
            return
        path = self._path(name)
        temporary = path.with_name(f".{path.stem}.{os.getpid()}.{os.urandom(4).hex()}")
        data = _first_line(name, body) + b"\n" + body
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                temporary.write_bytes(data)
                temporary.replace(path)
            finally:
                temporary.unlink(missing_ok=True)
        except OSError as error:
            self._warn(error)
            return
        # The listing of a large directory takes longer than a small run.
        if random() * self._limit_bytes < _LISTINGS * len(data):
            with contextlib.suppress(OSError):
                self._prune(self.directory)

    def _warn(self, error: OSError) -> None:
        if not self._warned:
            self._warned = True
            warnings.warn(
                f"the cache {self.directory} cannot be written ({error.strerror or error}); "
                f"continuing without it (set {VARIABLE} to another directory, or to '{_OFF}')",
                CacheWarning,
                stacklevel=3,
            )

    def _prune(self, directory: Path) -> None:
        """Remove the oldest files beyond the size limit, also those of killed writers. A file
        outside the folder for its name does not belong to the cache and stays."""
        found: list[tuple[float, int, Path]] = []
        for path in directory.glob("??/*"):
            if path.name.lstrip(".")[:2] != path.parent.name:
                continue
            with contextlib.suppress(OSError):
                status = path.stat()
                found.append((status.st_mtime, status.st_size, path))
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total <= self._limit_bytes:
                break
            with contextlib.suppress(OSError):
                path.unlink()
            total -= size


def _first_line(name: str, body: bytes) -> bytes:
    """Return the first line of a file: the format and a checksum of its name and content."""
    return (_MAGIC + hashlib.sha256(name.encode() + b"\n" + body).hexdigest()).encode()
