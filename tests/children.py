"""Programs in processes of their own, and the child processes that still exist."""

import os
import subprocess
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

TASKS = Path("/proc/self/task")


def ran(words: Iterable[object], **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a program to its end; what it wrote is text. ``options``: as of ``subprocess.run``."""
    usual = {"capture_output": True, "text": True, "timeout": 900, "check": False}
    return subprocess.run([*map(str, words)], **usual | options)


def gone(pid: int) -> bool:
    """Whether a process that is not our child has ended, waiting a moment for init."""
    for _ in range(15_000):
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True  # killed; its new parent has not looked yet
            os.kill(pid, 0)
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False


@contextmanager
def none_left() -> Iterator[None]:
    """Check that the block leaves no child process behind, beside those of other tests."""
    before = _children()
    yield
    left = _children() - before
    assert not left, f"children are left: {sorted(left)}"


def _children() -> frozenset[int]:
    """Return all children. If a thread ends while its file is read, another inherits its children,
    so all are read again."""
    while True:
        found: set[int] = set()
        try:
            for task in TASKS.iterdir():
                found.update(int(pid) for pid in (task / "children").read_text().split())
        except (FileNotFoundError, ProcessLookupError):
            continue
        return frozenset(found)
