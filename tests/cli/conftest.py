"""Run the safenav command as its users do: a process, its output, its exit status."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

import warm

Command = Callable[..., warm.Done]


@pytest.fixture
def safenav(tmp_path: Path) -> Command:
    """Run ``safenav ARGUMENTS...`` in a directory of its own, with a cache of its own."""
    own = {"SAFENAV_CACHE": str(tmp_path / "cache"), "NO_COLOR": "1"}

    def command(*arguments: object, **variables: str) -> warm.Done:
        return warm.safenav(*arguments, cwd=tmp_path, env={**os.environ, **own, **variables})

    return command
