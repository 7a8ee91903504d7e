"""Run the safenav command as its users do: a process, its output, its exit status."""

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import warm

Command = Callable[..., subprocess.CompletedProcess[str]]

MAIN = "from safenav.cli import main; main()"


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """The environment of the commands: a cache of their own, no colours."""
    return {**os.environ, "SAFENAV_CACHE": str(tmp_path / "cache"), "NO_COLOR": "1"}


@pytest.fixture
def safenav(environment: dict[str, str], tmp_path: Path) -> Command:
    """Run ``safenav ARGUMENTS...`` in a directory of its own."""

    def command(*arguments: object, **variables: str) -> subprocess.CompletedProcess[str]:
        return warm.safenav(*arguments, cwd=tmp_path, env={**environment, **variables})

    return command
