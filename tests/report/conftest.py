"""Made traces as files, shared by the tests of replay and pictures."""

from __future__ import annotations

from pathlib import Path

import pytest

from report import made_traces, team_trace
from safenav.report.replay import Replay
from safenav.report.replay_reading import read_replay


@pytest.fixture(scope="session")
def traces(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Trace files by name: door, chain, detour, meeting, and the long crowd."""
    folder = tmp_path_factory.mktemp("traces")
    makers = (
        made_traces.door,
        made_traces.chain,
        made_traces.detour,
        made_traces.crowd,
        team_trace.meeting,
    )
    return {
        maker.__name__: made_traces.write(maker(), folder / f"{maker.__name__}.jsonl")
        for maker in makers
    }


@pytest.fixture(scope="session")
def replays(traces: dict[str, Path]) -> dict[str, Replay]:
    return {name: read_replay(path) for name, path in traces.items()}
