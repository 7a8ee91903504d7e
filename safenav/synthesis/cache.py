"""Results of the synthesizer, stored on disk by all that they depend on.

The key is a hash of the specification's text, the binary's content and the options. An entry
carries a checksum of itself, appears by renaming, and is never changed: readers and writers of any
number of processes need no lock. An error costs a recomputation, never a run: damaged entries are
dropped, and a disk that cannot be written is reported once.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import time
import warnings
from collections.abc import Iterable
from pathlib import Path
from random import random

from msgspec import MsgspecError, Struct, msgpack

from safenav.errors import Verdict

VARIABLE = "SAFENAV_CACHE"
"""Environment variable: the directory, or ``off``."""

_OFF = "off"
_MAGIC = b"safenav-cache 2 "
_SUFFIX = ".answer"
_TEXT_SUFFIX = ".structuredslugs"
_LIMIT_BYTES = 512 << 20
_PRUNE_TO = 0.75
_LISTINGS = 64
"""Average number of listings of the directory while data equal to its limit is written."""
_STALE_TEMPORARY_SECONDS = 3600.0
_LASTING = frozenset({Verdict.REALIZABLE, Verdict.UNREALIZABLE})


class CacheWarning(UserWarning):
    """The cache cannot be used; everything still works, only slower."""


class CacheEntry(Struct, frozen=True):
    """A proven verdict, the cost of its synthesis, and the strategy if there is one."""

    verdict: Verdict
    seconds: float
    strategy_json: bytes | None


def key_of(text: str, binary_digest: str, options: Iterable[str]) -> str:
    """Return the key of a result, in hex. Each part is hashed with its length, so that parts cannot
    run together."""
    whole = hashlib.sha256()
    for part in (text, binary_digest, *options):
        data = part.encode()
        whole.update(len(data).to_bytes(8, "big"))
        whole.update(data)
    return whole.hexdigest()


class Cache:
    """A directory of results; without a directory, a cache that is always empty."""

    def __init__(self, directory: Path | None, limit_bytes: int = _LIMIT_BYTES) -> None:
        self.directory = directory
        self._limit_bytes = limit_bytes
        self._warned = False

    @classmethod
    def from_environment(cls) -> Cache:
        """``SAFENAV_CACHE`` (a directory, or ``off``), else the user's cache directory."""
        named = os.environ.get(VARIABLE)
        if named:
            return cls(None if named.lower() == _OFF else Path(named).expanduser())
        base = os.environ.get("XDG_CACHE_HOME", "")
        if base and Path(base).is_absolute():  # the XDG standard: ignore relative paths
            return cls(Path(base) / "safenav")
        try:
            return cls(Path.home() / ".cache" / "safenav")
        except RuntimeError:  # no home directory: a container with an unknown user
            return cls(None)

    @property
    def usable(self) -> bool:
        """Whether results can be kept in it."""
        try:
            if self.directory is not None:
                self.directory.mkdir(parents=True, exist_ok=True)
            return self.directory is not None and os.access(self.directory, os.W_OK)
        except OSError:
            return False

    def load(self, key: str) -> CacheEntry | None:
        """Return the result with that key, None if it is unknown or damaged (then it is
        dropped)."""
        if self.directory is None:
            return None
        path = self._path(key)
        try:
            data = path.read_bytes()
        except OSError:
            return None
        entry = _unpack(data, key)
        if entry is None:
            self.drop(key)
        return entry

    def store(self, key: str, entry: CacheEntry) -> None:
        """Keep a proven verdict; exhausted limits prove nothing and are not kept."""
        if self.directory is None or entry.verdict not in _LASTING:
            return
        self._write(self._path(key), _pack(entry, key))

    def _write(self, path: Path, data: bytes) -> None:
        temporary = path.with_name(f".{path.stem}.{os.getpid()}.{os.urandom(4).hex()}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                temporary.write_bytes(data)
                temporary.replace(path)
            except BaseException:
                with contextlib.suppress(OSError):
                    temporary.unlink()
                raise
        except OSError as error:
            self._warn(error)
            return
        self._bound(len(data))

    def keep_text(self, sha256: str, text: str) -> None:
        """Keep a specification's text under its sha256, by which traces name it."""
        if self.directory is None:
            return
        path = self._path(sha256, _TEXT_SUFFIX)
        if not path.exists():
            self._write(path, text.encode())

    def load_text(self, sha256: str) -> str | None:
        """Return the text with this sha256; None if it is not kept."""
        if self.directory is None:
            return None
        try:
            data = self._path(sha256, _TEXT_SUFFIX).read_bytes()
        except OSError:
            return None
        return data.decode() if hashlib.sha256(data).hexdigest() == sha256 else None

    def drop(self, key: str) -> None:
        """Remove a result that proved wrong."""
        if self.directory is not None:
            with contextlib.suppress(OSError):
                self._path(key).unlink()

    def _path(self, name: str, suffix: str = _SUFFIX) -> Path:
        assert self.directory is not None
        return self.directory / name[:2] / (name + suffix)

    def _warn(self, error: OSError) -> None:
        if not self._warned:
            self._warned = True
            warnings.warn(
                f"the cache {self.directory} cannot be written ({error.strerror or error}); "
                f"continuing without it (set {VARIABLE} to another directory, or to '{_OFF}')",
                CacheWarning,
                stacklevel=3,
            )

    def _bound(self, written: int) -> None:
        """Remove the oldest results beyond the limit. Listing a large directory takes longer than a
        small run, so a writer lists it with a probability proportional to the bytes written."""
        if random() * self._limit_bytes < _LISTINGS * written:
            with contextlib.suppress(OSError):
                self._prune()

    def _prune(self) -> None:
        assert self.directory is not None
        found: list[tuple[float, int, Path]] = []
        now = time.time()
        for shard in self.directory.iterdir():
            if len(shard.name) != 2 or not shard.is_dir():
                continue
            for path in shard.iterdir():
                with contextlib.suppress(OSError):
                    status = path.stat()
                    if path.suffix in (_SUFFIX, _TEXT_SUFFIX):
                        found.append((status.st_mtime, status.st_size, path))
                    elif now - status.st_mtime > _STALE_TEMPORARY_SECONDS:
                        path.unlink()  # of a writer that was killed
        total = sum(size for _, size, _ in found)
        if total <= self._limit_bytes:
            return
        for _, size, path in sorted(found):
            if total <= self._limit_bytes * _PRUNE_TO:
                break
            with contextlib.suppress(OSError):
                path.unlink()
            total -= size


def _pack(entry: CacheEntry, key: str) -> bytes:
    """Magic and checksum on the first line, then the key with the entry."""
    body = msgpack.encode((key, entry))
    return _MAGIC + hashlib.sha256(body).hexdigest().encode() + b"\n" + body


def _unpack(data: bytes, key: str) -> CacheEntry | None:
    first, _, body = data.partition(b"\n")
    if first != _MAGIC + hashlib.sha256(body).hexdigest().encode():
        return None
    try:
        name, entry = msgpack.decode(body, type=tuple[str, CacheEntry])
    except MsgspecError:
        return None
    return entry if name == key else None
