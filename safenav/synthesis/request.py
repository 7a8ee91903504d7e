"""Synthesis requests, their progress and their results. Proven negatives, timeouts and crashes
differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct

from safenav.outcome import Verdict
from safenav.spec.specification import Section, Specification

if TYPE_CHECKING:
    from safenav.synthesis.strategy import Strategy


class RequestKind(StrEnum):
    """The kind of request; the value names it in the cache."""

    REALIZABILITY = "realizability"
    STRATEGY = "strategy"
    COUNTERSTRATEGY = "counterstrategy"


PRINTED: Mapping[RequestKind, tuple[Verdict, tuple[str, ...]]] = {
    RequestKind.STRATEGY: (Verdict.REALIZABLE, ("--explicitStrategy", "--jsonOutput")),
    RequestKind.COUNTERSTRATEGY: (Verdict.UNREALIZABLE, ("--counterStrategy", "--jsonOutput")),
}
"""The verdict with which an automaton is printed, and options for that, which every binary has."""


class SynthesisResult(Struct, frozen=True):
    """One result of the synthesizer.

    ``strategy``: not None exactly if the verdict is realizable and a strategy was requested, or
    unrealizable and a counterstrategy was. ``seconds``: wall time of the subprocess (of the
    original one if ``cached``). ``spec_sha256`` and ``strategy_sha256``: hex digests of the
    structured-slugs text and of the JSON that the synthesizer printed. ``detail``: its last
    messages beyond the verdict, such as its progress before a limit. ``verified``: True if an
    independent check accepted the strategy, None without a check (a strategy that the check rejects
    is an error, never a result).
    """

    robot: str
    verdict: Verdict
    seconds: float
    cached: bool
    spec_sha256: str
    strategy: Strategy | None = None
    strategy_json: bytes | None = None
    strategy_sha256: str | None = None
    detail: str = ""
    verified: bool | None = None

    @property
    def states(self) -> int | None:
        """Number of nodes of the strategy, None if there is none."""
        return len(self.strategy.states) if self.strategy is not None else None


class SynthesisProgress(Struct, frozen=True):
    """A synthesis that finished with a ``result``, or that still runs (reported twice per second).
    ``index``: which of the specifications it belongs to."""

    index: int
    robot: str
    seconds: float
    result: SynthesisResult | None = None


Listener = Callable[[SynthesisProgress], None]


class Job(Struct, frozen=True):
    """One request: its kind and its specification."""

    index: int
    spec: Specification
    text: str
    kind: RequestKind

    @property
    def robot(self) -> str:
        return self.spec.robot

    @property
    def options(self) -> tuple[str, ...]:
        """The options for the binary. A strategy that relies on fairness assumptions moves on
        where it can, and waits for the other robots only where it must."""
        _, options = PRINTED.get(self.kind, (None, ()))
        if self.kind is RequestKind.STRATEGY and self.spec.section(Section.ENV_LIVENESS):
            options += ("--biasForAction",)
        return options
