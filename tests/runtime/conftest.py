"""Run scenarios with the real synthesizer and look at nothing but their traces."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path

import pytest

from runtime.played import Run, Runner
from safenav.audit.check import check_trace
from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.writing import TraceWriter


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Runner:
    """Run a scenario given as YAML text; its trace must pass the audit."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))

    def runner(text: str) -> Run:
        scenario = load_scenario_text(textwrap.dedent(text), "scenario.yaml")
        path = tmp_path / "trace.jsonl"
        with TraceWriter(path) as trace:
            Mission(scenario, listeners=[trace]).run()
        audit = check_trace(path)
        assert audit.findings == (), "\n".join(map(str, audit.findings))
        return Run([json.loads(line) for line in path.read_text().splitlines()])

    return runner
