"""Every shipped scenario runs as it expects, and its trace breaks no rule."""

from pathlib import Path

import pytest

from once import SCENARIOS, trace_of_shipped
from safenav.batch.case import Ledger, differences
from safenav.run.checked import check_trace
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.file import read_bytes

SHIPPED = sorted(SCENARIOS.glob("*.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_the_audit_accepts_the_run_of_each_shipped_scenario(path: Path) -> None:
    scenario = load_scenario(path)
    assert scenario.expect.outcome is not None
    file = trace_of_shipped(path.stem)
    audit = check_trace(file)
    assert audit.findings == (), "\n".join(map(str, audit.findings))
    assert audit.complete
    ledger = Ledger()
    for record in read_bytes(file.read_bytes()).records:
        ledger(record)
    assert differences(scenario.expect, ledger) == []
