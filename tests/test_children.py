"""The check that nothing is left behind sees what is left, and only that."""

import subprocess
import sys

import pytest

from children import none_left

WAITS = [sys.executable, "-c", "input()"]


def test_a_remaining_child_is_found_running_and_as_a_zombie() -> None:
    with subprocess.Popen(WAITS, stdin=subprocess.PIPE) as earlier:
        with none_left():
            pass
        for command in (WAITS, [sys.executable, "-c", ""]):
            with pytest.raises(AssertionError, match="left"), none_left():
                left = subprocess.Popen(command, stdin=subprocess.PIPE)
            left.kill()
            left.communicate()
        earlier.kill()
