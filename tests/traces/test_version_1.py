"""Traces of version 1, written by safenav before version 2, still read, check and replay."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from safenav.audit.check import check_trace
from safenav.report.replay.reading import read_replay
from safenav.trace.reading import read_trace
from safenav.trace.vocabulary import Ending
from safenav.trace.writing import as_data

TRACES = sorted((Path(__file__).parent / "version_1").glob("*.jsonl"))


@pytest.fixture(params=TRACES, ids=lambda path: str(path.stem))
def file(request: pytest.FixtureRequest) -> Path:
    return Path(request.param)


def test_every_line_is_read(file: Path) -> None:
    trace = read_trace(file)
    assert trace.header.trace == 1
    assert 1 + len(trace.records) == len(file.read_text().splitlines())
    assert trace.ignored == 0
    assert trace.outcome is not None and trace.outcome.outcome is Ending.COMPLETED


def test_what_is_read_is_written_as_it_was(file: Path) -> None:
    trace = read_trace(file)
    written = [as_data(record) for record in (trace.header, *trace.records)]
    for robot in written[0]["scenario"]["robots"].values():
        robot.setdefault("vision", None)  # version 1 told it as null
    told = [json.loads(line) for line in file.read_text().splitlines()]
    for robot in (
        *told[0]["scenario"]["robots"].values(),
        *written[0]["scenario"]["robots"].values(),
    ):
        robot["capabilities"].sort()
        robot["conflicts"].sort()
    assert written == told


def test_no_rule_is_broken(file: Path) -> None:
    audit = check_trace(file)
    assert (audit.findings, audit.complete) == ((), True)


def test_it_replays(file: Path) -> None:
    replay = read_replay(file)
    assert replay.last == max(record.tick for record in read_trace(file).records)
    assert replay.ending is not None
