"""Missions that once failed, each through the real command line.

The first comment of a file is its story. Most can be completed and say so; the others end with
a proof, which the judge's own search confirms.
"""

from pathlib import Path

import pytest

import warm

CASES = sorted((Path(__file__).parent / "cases").rglob("*.yaml"))


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.stem)
def test_a_mission_that_once_failed_is_completed_or_proven_impossible(file: Path) -> None:
    done = warm.program("campaigns.__main__", "--file", file, "--seconds", 300)
    assert done.returncode == 0, done.stdout + done.stderr
