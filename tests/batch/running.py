"""Run ``safenav batch`` as a command of its own."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import warm

SAFENAV = [sys.executable, "-c", "from safenav.cli import main; main()"]


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def safenav(*words: str) -> warm.Done:
    return warm.safenav("batch", *words, env=environment())


@contextmanager
def started(*words: str) -> Iterator[subprocess.Popen[str]]:
    """The command while it runs; killed at the end if it still does."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*SAFENAV, "batch", *words], stdout=pipe, stderr=pipe, text=True, env=environment()
    ) as batch:
        try:
            yield batch
        finally:
            batch.kill()


def wait_until(batch: subprocess.Popen[str], reached: Callable[[], bool]) -> None:
    while not reached():
        assert batch.poll() is None, batch.communicate()
        time.sleep(0.01)
