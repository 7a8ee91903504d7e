"""The safenav command as a process exposed to faults, and slugs binaries that fail."""

import ctypes
import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import warm
from children import ran
from safenav.run.checked import check_trace
from safenav.synthesis.program import find_binary

MAIN = "from safenav.cli import main; main()"
ROOT = Path(__file__).parents[2]
CASE_STUDY = ROOT / "scenarios" / "case_study_1.yaml"

_PR_CAPBSET_DROP = 24
_CAP_DAC_OVERRIDE = 1
_CAP_DAC_READ_SEARCH = 2

Done = subprocess.CompletedProcess[str]


class Process:
    """Runs ``safenav ARGUMENTS...`` in a directory and with a cache of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.cache = folder / "cache"
        self.environment = {
            **os.environ,
            "SAFENAV_CACHE": str(self.cache),
            "NO_COLOR": "1",
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        }

    def command(self, *arguments: object) -> list[str]:
        return [sys.executable, "-c", MAIN, *map(str, arguments)]

    def __call__(
        self,
        *arguments: object,
        limit: Callable[[], None] | None = None,
        seconds: float = 120,
        **variables: str,
    ) -> Done:
        """Run to the end, and check that there is no traceback."""
        environment = {**self.environment, **variables}
        if limit is None:
            done = warm.safenav(*arguments, cwd=self.folder, env=environment)
        else:  # Python 3.11 does not notice that a compiled file was cut off, and others read it
            done = ran(
                self.command(*arguments),
                timeout=seconds,
                cwd=self.folder,
                env={**environment, "PYTHONDONTWRITEBYTECODE": "1"},
                preexec_fn=limit,
            )
        assert "Traceback" not in done.stderr
        return done


@pytest.fixture
def safenav(tmp_path: Path) -> Process:
    return Process(tmp_path)


Script = Callable[[str], str]


@pytest.fixture
def slugs_that(tmp_path: Path) -> Script:
    """Makes a program that is the real slugs but for one answer in mid-run, which ``body`` gives
    ($SLUGS is the real one, "$@" what it is asked)."""

    def make(body: str) -> str:
        path, count = tmp_path / "slugs that fails", tmp_path / "count"
        path.write_text(
            f"""#!/bin/sh
SLUGS="{find_binary().path}"
if [ "$1" = --version ]; then exec "$SLUGS" --version; fi
echo asked >> "{count}"
if [ "$(wc -l < "{count}")" -lt 3 ] || ! mkdir "{count}.failed" 2>/dev/null; then
    exec "$SLUGS" "$@"
fi
{body}
"""
        )
        path.chmod(0o755)
        return str(path)

    return make


def records(trace: Path) -> list[dict[str, Any]]:
    """The lines of a trace, every one of them whole; the audit must find nothing."""
    assert check_trace(trace).findings == ()
    return [json.loads(line) for line in trace.read_text(encoding="utf-8").splitlines()]


def small_files(most: int = 4096) -> None:
    """No file of the process may grow beyond 4 kB: what a full disk looks like."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


def no_privileges() -> None:
    """Let read-only files be read-only for root as well."""
    if os.geteuid() == 0:
        library = ctypes.CDLL(None)
        for capability in (_CAP_DAC_OVERRIDE, _CAP_DAC_READ_SEARCH):
            library.prctl(_PR_CAPBSET_DROP, capability, 0, 0, 0)
