"""Where cases are run: what the batch needs from a pool of processes or a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from msgspec import Struct

from safenav.batch.cases.case import Case, Result


class Arrival(Struct, frozen=True):
    """A result, and where the trace of the run lies until somebody wants it or not."""

    case: Case
    result: Result
    trace: Path | None = None


class Backend(Protocol):
    """Runs cases; whatever becomes of one, its result arrives."""

    def submit(self, case: Case) -> None:
        """Run it when there is room. Returns immediately."""

    def collect(self, seconds: float) -> list[Arrival]:
        """Return the results that have arrived, waiting at most ``seconds`` for the first.

        Raises SafenavError if no more cases can be run at all.
        """

    def running(self) -> list[tuple[str, float]]:
        """Names of cases in work, as far as known, with their seconds so far."""

    def close(self) -> None:
        """Stop all work, leaving no process behind."""
