"""Made traces as files, shared by the tests of replay and pictures; each is made when a test
first needs it."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest

from report import made_traces
from safenav.report.page.html import page_of
from safenav.run.reading import read_run
from safenav.run.run import Run

T = TypeVar("T")


class Made(dict[str, T]):
    """What ``make`` gives for a name, once."""

    def __init__(self, make: Callable[[str], T]) -> None:
        self._make = make

    def __missing__(self, name: str) -> T:
        self[name] = self._make(name)
        return self[name]


@pytest.fixture(scope="session")
def traces(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Trace files by name: door, chain, detour, meeting, slow, and the long crowd."""
    folder = tmp_path_factory.mktemp("traces")
    return Made(
        lambda name: made_traces.write(getattr(made_traces, name)(), folder / f"{name}.jsonl")
    )


@pytest.fixture(scope="session")
def replays(traces: dict[str, Path]) -> dict[str, Run]:
    return Made(lambda name: read_run(traces[name]))


@pytest.fixture(scope="session")
def pages(replays: dict[str, Run], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")

    def make(name: str) -> Path:
        page = folder / f"{name}.html"
        page.write_text(page_of(replays[name], f"{name}.jsonl"))
        return page

    return Made(make)
