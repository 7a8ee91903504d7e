"""Synthesis requests and progress reports."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from msgspec import Struct

from safenav.outcome import Verdict
from safenav.spec.specification import Section, Specification
from safenav.synthesis.verdict import SynthesisResult


class RequestKind(StrEnum):
    """The kind of request; the value names it in the cache."""

    REALIZABILITY = "realizability"
    STRATEGY = "strategy"
    COUNTERSTRATEGY = "counterstrategy"
    MOVES = "moves"

    @property
    def options(self) -> tuple[str, ...]:
        """Options that every slugs binary knows; with none of them, the verdict alone is given."""
        match self:
            case RequestKind.REALIZABILITY | RequestKind.MOVES:
                return ()
            case RequestKind.STRATEGY:
                return ("--explicitStrategy", "--jsonOutput")
            case RequestKind.COUNTERSTRATEGY:
                return ("--counterStrategy", "--jsonOutput")

    @property
    def ending(self) -> Verdict:
        """The verdict with which an automaton is printed."""
        if self is RequestKind.COUNTERSTRATEGY:
            return Verdict.UNREALIZABLE
        return Verdict.REALIZABLE


class RequestPhase(StrEnum):
    RUNNING = "running"
    FINISHED = "finished"


class SynthesisProgress(Struct, frozen=True):
    """Something happened in a synthesis: it still runs (reported once per second), or finished
    with a result. ``index``: which of the specifications it belongs to."""

    index: int
    robot: str
    phase: RequestPhase
    seconds: float
    result: SynthesisResult | None = None


Listener = Callable[[SynthesisProgress], None]


class Job(Struct, frozen=True):
    """One request: its kind and its specification."""

    index: int
    spec: Specification
    text: str
    kind: RequestKind
    most_nodes: int | None = None

    @property
    def robot(self) -> str:
        return self.spec.robot

    @property
    def options(self) -> tuple[str, ...]:
        """The options for the binary. A strategy that relies on fairness assumptions moves on
        where it can, and waits for the other robots only where it must."""
        options = self.kind.options
        moves = self.kind in (RequestKind.STRATEGY, RequestKind.MOVES)
        if moves and self.spec.section(Section.ENV_LIVENESS):
            options += ("--biasForAction",)
        return options

    def progress(
        self, phase: RequestPhase, seconds: float, result: SynthesisResult | None = None
    ) -> SynthesisProgress:
        return SynthesisProgress(self.index, self.robot, phase, seconds, result)
