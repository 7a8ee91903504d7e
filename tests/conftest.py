"""For all tests: interrupts are heard, and syntheses are kept for this test run alone.

A shell starts background jobs with SIGINT ignored, and programs pass that on to theirs.
"""

import os
import shutil
import signal
import tempfile

import pytest

_KEPT = "SAFENAV_TEST_CACHE"


def pytest_configure(config: pytest.Config) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if _KEPT not in os.environ:  # else another process of this test run has made it
        folder = tempfile.mkdtemp(prefix="safenav-cache-")
        os.environ[_KEPT] = folder
        config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))
    os.environ["SAFENAV_CACHE"] = os.environ[_KEPT]
