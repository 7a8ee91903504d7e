"""What the synthesizer is asked, and what is told while it works on it."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from safenav.dataclass import dataclass
from safenav.spec.specification import Section, Specification
from safenav.synthesis.verdict import SynthesisResult, Verdict


class Question(StrEnum):
    """What is asked; the value names it in the cache."""

    REALIZABILITY = "realizability"
    STRATEGY = "strategy"
    COUNTERSTRATEGY = "counterstrategy"
    MOVES = "moves"

    @property
    def options(self) -> tuple[str, ...]:
        """Options that every slugs binary knows; without any, the verdict alone is given."""
        match self:
            case Question.REALIZABILITY | Question.MOVES:
                return ()
            case Question.STRATEGY:
                return ("--explicitStrategy", "--jsonOutput")
            case Question.COUNTERSTRATEGY:
                return ("--counterStrategy", "--jsonOutput")

    @property
    def answered_by(self) -> Verdict:
        """The verdict with which an automaton is printed."""
        if self is Question.COUNTERSTRATEGY:
            return Verdict.UNREALIZABLE
        return Verdict.REALIZABLE


class QuestionPhase(StrEnum):
    STARTED = "started"
    RUNNING = "running"
    FINISHED = "finished"


@dataclass(frozen=True)
class SynthesisProgress:
    """Something happened in a synthesis: it started, still runs (told once a second), or
    finished with a result. ``index``: which of the specifications asked about."""

    index: int
    robot: str
    phase: QuestionPhase
    seconds: float
    result: SynthesisResult | None = None


Listener = Callable[[SynthesisProgress], None]


@dataclass(frozen=True)
class Job:
    """One question about one specification."""

    index: int
    spec: Specification
    text: str
    question: Question
    most_nodes: int | None = None

    @property
    def robot(self) -> str:
        return self.spec.robot

    @property
    def options(self) -> tuple[str, ...]:
        """The options for the binary. A strategy that relies on fairness assumptions shall move
        on where it can by itself, and wait for the others only where it must."""
        options = self.question.options
        moves = self.question in (Question.STRATEGY, Question.MOVES)
        if moves and self.spec.section(Section.ENV_LIVENESS):
            options += ("--biasForAction",)
        return options

    def progress(
        self, phase: QuestionPhase, seconds: float, result: SynthesisResult | None = None
    ) -> SynthesisProgress:
        return SynthesisProgress(self.index, self.robot, phase, seconds, result)
