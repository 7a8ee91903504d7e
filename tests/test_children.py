"""The check that nothing is left behind sees what is left, and only that."""

import subprocess
import sys
from pathlib import Path

import pytest

from children import none_left, ran

WAITS = [sys.executable, "-c", "input()"]


def test_a_child_that_is_left_is_seen_running_and_as_a_zombie() -> None:
    with subprocess.Popen(WAITS, stdin=subprocess.PIPE) as earlier:
        with none_left():
            pass
        for command in (WAITS, [sys.executable, "-c", ""]):
            with pytest.raises(AssertionError, match="left"), none_left():
                left = subprocess.Popen(command, stdin=subprocess.PIPE)
            left.kill()
            left.communicate()
        earlier.kill()


def test_the_program_that_starts_commands_leaves_nothing_open() -> None:
    """Its connection was closed by the interpreter, which warned of it at the end of the suite."""
    script = "import warm; print(warm.safenav('--version').stdout)"
    command = [sys.executable, "-W", "always", "-c", script]
    done = ran(command, cwd=Path(__file__).parent)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("safenav, version")
