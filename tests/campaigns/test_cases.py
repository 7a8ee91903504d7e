"""Missions that once failed, each through the real command line.

The first comment of a file is its story. Most can be completed and say so; the others end with
a proof, which the judge's own search confirms.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from campaigns.command import Command
from campaigns.verdict import judge

CASES = sorted((Path(__file__).parent / "cases").rglob("*.yaml"))


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.stem)
def test_case_ends_as_it_can(file: Path) -> None:
    data = yaml.safe_load(file.read_text(encoding="utf-8"))
    result = judge(data, Command(), seconds=300.0)
    assert not result.is_finding, f"{result.kind}: {result.detail}"
    wanted = (data.get("expect") or {}).get("outcome")
    if wanted == "completed":
        assert result.kind == "completed", result.detail
