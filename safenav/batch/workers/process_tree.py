"""Kill a process together with all that it started, even what has left its group.

Synthesizers lead process groups of their own, and outlive a worker that crashed. On Linux they
are known by a mark in their environment, which they inherit and keep when they are orphaned;
elsewhere by the tree of parents, which must be read while the worker still stands.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

MARK = "SAFENAV_BATCH_WORKER"
"""Environment variable: a different value for each worker."""

_ROUNDS = 5
"""A process may start another one while we look."""


def kill_family(pid: int, mark: str) -> None:
    """SIGKILL to a child of ours (not yet reaped) and to its descendants."""
    if not sys.platform.startswith("linux"):
        for descendant in _descendants(pid):
            _kill(descendant)
        _kill(pid)
        return
    _kill(pid)
    kill_orphans(mark)


def kill_orphans(mark: str) -> None:
    """SIGKILL to whatever carries the mark; nothing where marks cannot be seen."""
    wanted = f"{MARK}={mark}".encode()
    for _ in range(_ROUNDS):
        found = [pid for pid in _processes() if wanted in _environment(pid)]
        for pid in found:
            _kill(pid)
        if not found:
            return


def _processes() -> list[int]:
    with contextlib.suppress(OSError):
        return [int(entry) for entry in os.listdir("/proc") if entry.isdecimal()]  # noqa: PTH208
    return []


def _environment(pid: int) -> list[bytes]:
    """Empty for the dead and for those of other users."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    return []


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
