"""Settings of all tests: SIGINT is not ignored, temporary files are in memory, the synthesis cache
lasts for this test run, random examples have no deadline, and each process has one browser.

A shell starts background jobs with SIGINT ignored, which child processes inherit.
"""

from __future__ import annotations

import fcntl
import gc
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import pytest
from hypothesis import HealthCheck, settings

from drawn import PLAYED, Plays
from once import FOLDER, RUNNING

if TYPE_CHECKING:
    from report.browser import Browser


def pytest_configure(config: pytest.Config) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if "TMPDIR" not in os.environ and (memory := _memory()):
        os.environ["TMPDIR"], tempfile.tempdir = memory, None
    if FOLDER not in os.environ:  # else another process of this test run has made it
        folder = tempfile.mkdtemp(prefix="safenav-tests-")
        os.environ[FOLDER] = folder
        running = (Path(folder) / RUNNING).open("w")
        fcntl.flock(running, fcntl.LOCK_EX)
        config.add_cleanup(running.close)
        config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))
    config.pluginmanager.register(Plays())
    untimed = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.register_profile("busy machine", untimed)
    settings.load_profile("busy machine")
    os.environ["SAFENAV_CACHE"] = str(Path(os.environ[FOLDER]) / "cache")
    # As the command does: the search for cycles took a fifteenth of the tests' own time.
    gc.set_threshold(100_000, 20, 100)
    # The workers keep the processors busy; threads of a library would only spin.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _memory() -> str | None:
    """A file system in memory, if programs may run there and a test run has enough space: making
    and removing files takes a sixth of the system's time there, and no disk is waited for."""
    place, enough = "/dev/shm", 2 << 30
    if not os.access(place, os.W_OK | os.X_OK):
        return None
    there = os.statvfs(place)
    usable = not there.f_flag & os.ST_NOEXEC and there.f_bavail * there.f_frsize >= enough
    return place if usable else None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _promised((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _promised((yield))


Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)


def _promised(report: Report) -> Report:
    """Fail instead of skipping if a tool is missing that the environment promises: SAFENAV_TOOLS
    lists words of skip reasons."""
    tools = os.environ.get("SAFENAV_TOOLS", "").lower().split()
    if report.skipped and isinstance(report.longrepr, tuple):
        reason = report.longrepr[2]
        if missing := [tool for tool in tools if tool in reason.lower()]:
            report.outcome = "failed"
            report.longrepr = f"{reason}; this environment promises {', '.join(missing)}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Disable the garbage collector during collection: nearly all objects stay, and searching them
    takes two fifths of the time, in each worker."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the slow tests of each worker first: its last tests are then short, so that other workers
    can take them over and all end together."""
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "0"))
    if not workers:
        return
    share = -(-len(items) // workers) or 1
    for first in range(0, len(items), share):
        part = slice(first, first + share)
        items[part] = sorted(items[part], key=lambda item: "slow" not in item.keywords)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    from report.browser import Browser  # skips where there is no selenium

    found = Browser()
    yield found
    found.driver.quit()


@pytest.fixture(scope="module")
def browser(chromium: Browser) -> Iterator[Browser]:
    """Return a browser with an empty page; the page is emptied again when the module ends."""
    chromium.leave()
    yield chromium
    chromium.leave()


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Extend the time limits of searches to minutes, so that they succeed on a busy machine."""
    for constant in (
        "safenav.explain.investigation.REPAIR_SECONDS",
        "safenav.explain.play.BUDGET_SECONDS",
        "safenav.review.postmortem.RUN_SECONDS",
        "safenav.review.postmortem.QUESTION_SECONDS",
    ):
        monkeypatch.setattr(constant, 120.0)


@pytest.fixture
def played(request: pytest.FixtureRequest) -> Callable[[], None]:
    """Record that a case of a random test has played something. A test that asks for this fixture
    and does not call it has played nothing; in too many cases, the test run fails."""
    request.node.user_properties.append((PLAYED, False))

    def record() -> None:
        request.node.user_properties.append((PLAYED, True))

    return record
