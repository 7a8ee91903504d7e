"""The processes that this one has started and that are still there, running or as zombies."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TASKS = Path("/proc/self/task")


@contextmanager
def none_left() -> Iterator[None]:
    """What happens inside leaves no child behind. Children that were there before are another
    test's, like the browser that a worker keeps; where there is no /proc, nobody may have any."""
    before = _children()
    yield
    if before is None:
        try:
            left: object = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        raise AssertionError(f"a child is left: {left}")
    left = (_children() or frozenset()) - before
    assert not left, f"children are left: {sorted(left)}"


def _children() -> frozenset[int] | None:
    found: set[int] = set()
    for task in TASKS.glob("*/children"):
        found.update(int(pid) for pid in task.read_text().split())
    return frozenset(found) if TASKS.is_dir() else None
