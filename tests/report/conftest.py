"""Made traces as files, shared by the tests of replay and pictures."""

from pathlib import Path

import pytest

from report import made_traces
from safenav.report.page.html import page_of
from safenav.report.replay.reading import read_replay
from safenav.report.replay.timeline import Replay


@pytest.fixture(scope="session")
def traces(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Trace files by name: door, chain, detour, meeting, slow, and the long crowd."""
    folder = tmp_path_factory.mktemp("traces")
    makers = (
        made_traces.door,
        made_traces.chain,
        made_traces.detour,
        made_traces.meeting,
        made_traces.slow,
        made_traces.crowd,
    )
    return {
        maker.__name__: made_traces.write(maker(), folder / f"{maker.__name__}.jsonl")
        for maker in makers
    }


@pytest.fixture(scope="session")
def replays(traces: dict[str, Path]) -> dict[str, Replay]:
    return {name: read_replay(path) for name, path in traces.items()}


@pytest.fixture(scope="module")
def pages(replays: dict[str, Replay], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    written = {}
    for name, replay in replays.items():
        written[name] = folder / f"{name}.html"
        written[name].write_text(page_of(replay, f"{name}.jsonl"))
    return written
