"""The missions that decided the rules of coordination: each is completed, and passes the audit."""

from __future__ import annotations

from pathlib import Path

import pytest

from safenav.audit.check import check_trace
from safenav.runtime.mission import Mission
from safenav.scenario.model import Outcome
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.writing import TraceWriter

MISSIONS = sorted((Path(__file__).parent / "missions").glob("*.yaml"))


@pytest.mark.parametrize("file", MISSIONS, ids=lambda file: file.stem)
def test_what_can_be_completed_is_completed(file: Path, tmp_path: Path) -> None:
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        result = Mission(load_scenario(file), listeners=[writer]).run()
    assert result.outcome is Outcome.COMPLETED, result.explanation
    assert check_trace(trace).findings == ()
