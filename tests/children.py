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
    """A thread that ends while its file is read hands its children to another: read all again."""
    while (TASKS / str(os.getpid()) / "children").is_file():
        found: set[int] = set()
        try:
            for task in TASKS.iterdir():
                found.update(int(pid) for pid in (task / "children").read_text().split())
        except (FileNotFoundError, ProcessLookupError):
            continue
        return frozenset(found)
    return None
