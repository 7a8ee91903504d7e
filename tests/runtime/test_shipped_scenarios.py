"""Every shipped scenario runs as it expects, and its trace breaks no rule."""

from __future__ import annotations

from pathlib import Path

import pytest

from safenav.audit.check import check_trace
from safenav.runtime.expectation import Ledger, differences
from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.writing import TraceWriter

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SHIPPED = sorted(SCENARIOS.glob("*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_audit_finds_nothing(path: Path, tmp_path: Path) -> None:
    scenario = load_scenario(path)
    assert scenario.expect.outcome is not None
    ledger = Ledger()
    with TraceWriter(tmp_path / "trace.jsonl") as trace:
        Mission(scenario, listeners=[trace, ledger]).run()
    audit = check_trace(tmp_path / "trace.jsonl")
    assert audit.findings == (), "\n".join(map(str, audit.findings))
    assert audit.complete
    assert differences(scenario.expect, ledger) == []
