"""For all tests: interrupts are heard, syntheses are kept for this test run alone, and each
process has one browser.

A shell starts background jobs with SIGINT ignored, and programs pass that on to theirs.
"""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from report.browser import Browser

_KEPT = "SAFENAV_TEST_CACHE"


def pytest_configure(config: pytest.Config) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if _KEPT not in os.environ:  # else another process of this test run has made it
        folder = tempfile.mkdtemp(prefix="safenav-cache-")
        os.environ[_KEPT] = folder
        config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))
    os.environ["SAFENAV_CACHE"] = os.environ[_KEPT]


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    from report.browser import Browser  # skips where there is no selenium

    found = Browser()
    yield found
    found.driver.quit()


@pytest.fixture(scope="module")
def browser(chromium: Browser) -> Iterator[Browser]:
    """A browser that shows nothing yet, and nothing when the module has ended."""
    chromium.leave()
    yield chromium
    chromium.leave()
