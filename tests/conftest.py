"""For all tests: interrupts are heard, also where the test run itself was started to ignore them.

A shell starts background jobs with SIGINT ignored, and programs pass that on to theirs.
"""

import signal


def pytest_configure() -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
