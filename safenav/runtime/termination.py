"""Termination of a run, in one way for every cause.

Code that finds that a run cannot or must not continue raises ``RunEnded`` with the conclusion; the
mission catches it in one place. Every search queries ``Stop``.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from msgspec import Struct, field

from safenav.outcome import Outcome
from safenav.trace.proofs import Proof


class Conclusion(Struct, frozen=True):
    """Reason for the end of a run. ``cause`` and ``proof``: of ``operator_needed`` (docs/trace.md),
    with the ``links`` of its reasons, one sentence each, and the robots that are ``stuck``.
    ``refused``: deadlines and charges that do not suffice, each with the least value that does
    (None: none does)."""

    outcome: Outcome
    explanation: str
    cause: str | None = None
    proof: Proof | None = None
    unrealizable: Mapping[str, str] | None = None
    links: tuple[str, ...] = ()
    stuck: tuple[str, ...] = ()
    refused: Mapping[str, int | None] | None = None


class RunEnded(BaseException):
    """The run ends with ``conclusion``. Not an Exception: like KeyboardInterrupt, a signal may
    raise it anywhere, and a library running there must not handle it as its own error."""

    def __init__(self, conclusion: Conclusion) -> None:
        self.conclusion = conclusion
        super().__init__(conclusion.explanation)


class Stop(Struct):
    """Whether a run must end from outside: by a request, or because its time is up.

    ``seconds``: wall time of the whole run, counted from the last ``begin``.
    """

    seconds: float | None = None
    asked: str | None = None
    _begun: float = field(default_factory=time.monotonic)

    def begin(self) -> None:
        self._begun = time.monotonic()

    def rest(self, seconds: float) -> None:
        """Exclude this many seconds from the time limit."""
        self._begun += seconds

    def ask(self, why: str) -> None:
        """End the run at the next opportunity."""
        self.asked = self.asked or why

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self._begun

    def check(self) -> None:
        """Raise RunEnded if the run must end now."""
        if self.asked is not None:
            raise RunEnded(Conclusion(Outcome.INTERRUPTED, self.asked))
        if self.seconds is not None and self.elapsed > self.seconds:
            explanation = f"not completed after {self.seconds:g} s, the limit of the run"
            raise RunEnded(Conclusion(Outcome.TIME_LIMIT, explanation))
