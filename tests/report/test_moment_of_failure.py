"""A run that ends within a tick is shown as it was in that moment."""

from pathlib import Path

import pytest

from once import beside
from safenav.cli.run import run as run_command
from safenav.report.page.encode import LiveRun, encoded
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.trace.reading import Trace, read_trace

SCENARIO = beside(__file__, "scenarios/failing.yaml")


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    folder = tmp_path_factory.mktemp("failed")
    (folder / "s.yaml").write_text(SCENARIO)
    file: Path = folder / "run.jsonl"
    arguments = [str(folder / "s.yaml"), "--trace", str(file), "--no-map"]
    assert run_command.main(arguments, standalone_mode=False) == 1
    return read_trace(file)


@pytest.fixture
def failed(trace: Trace) -> Run:
    return run_of(trace)


def test_the_last_tick_is_that_of_the_outcome(failed: Run) -> None:
    (violation,) = [event for event in failed.events if event.kind.value == "violation"]
    assert failed.events[-1].tick == failed.last == violation.tick
    assert failed.within, "the second robot had not taken its turn"
    assert f"tick {failed.last} of {failed.last}, ended within it: operator needed" == (
        failed.at(failed.last).moment
    )


def test_all_pages_that_are_opened_later_show_the_same_moment(trace: Trace, failed: Run) -> None:
    live = LiveRun(trace.header, "run.jsonl")
    for record in trace.records:
        live.append(record)
    assert live.whole() == live.whole() == encoded(failed, "run.jsonl")
