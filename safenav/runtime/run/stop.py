"""The end of a run from outside: by a request, or because its time is up."""

from __future__ import annotations

import time

from safenav.outcome import Outcome
from safenav.runtime.control.ends import End


class Stopped(BaseException):
    """The run ends with ``end``. Not an Exception: like KeyboardInterrupt, a signal may raise it
    anywhere, and a library running there must not handle it as its own error."""

    def __init__(self, end: End) -> None:
        self.end = end
        super().__init__(end.why)


class Stop:
    """``seconds``: the most wall time of the run (None: any). ``asked``: why it is to end."""

    def __init__(self, seconds: float | None) -> None:
        self.seconds, self.asked = seconds, ""
        self.begin()

    def begin(self) -> None:
        self._begun = time.monotonic()

    def rest(self, seconds: float) -> None:
        """Exclude this many seconds from the time of the run."""
        self._begun += seconds

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self._begun

    def check(self) -> None:
        """Raise Stopped if the run must end now."""
        if self.asked:
            raise Stopped(End(Outcome.INTERRUPTED, self.asked))
        if self.seconds is not None and self.elapsed > self.seconds:
            why = f"not completed after {self.seconds:g} s, the limit of the run"
            raise Stopped(End(Outcome.TIME_LIMIT, why))
