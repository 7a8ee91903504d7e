"""What a rule is, and what it finds."""

# ruff: noqa: ARG002 (a rule answers the questions that concern it and ignores the others)

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from safenav.audit.situation import Situation
from safenav.trace.records import Record


@dataclass(frozen=True)
class Finding:
    """A broken rule: in which tick, by whom (None: by nobody in particular), told by which
    line of the trace, and what is wrong in the words of the scenario."""

    rule: str
    tick: int
    robot: str | None
    line: int
    explanation: str

    def __str__(self) -> str:
        whom = f", {self.robot}" if self.robot else ""
        return f"line {self.line}: {self.rule} (tick {self.tick}{whom}): {self.explanation}"


class Rule:
    """One thing that must hold of every run. One object checks one trace, and may remember.

    ``name`` is how the rule is called in reports; the docstring says what it demands and by
    which right (D: the design's section, T: docs/trace.md).
    """

    name: ClassVar[str]

    def opening(self, now: Situation) -> Iterable[Finding]:
        """Asked once, with the header alone."""
        return ()

    def line(self, record: Record, now: Situation) -> Iterable[Finding]:
        """Asked for each line, before it takes effect."""
        return ()

    def turn(self, now: Situation) -> Iterable[Finding]:
        """Asked when a turn is over (``now.turn``)."""
        return ()

    def ending(self, now: Situation) -> Iterable[Finding]:
        """Asked once, after the last line."""
        return ()

    def broken(self, tick: int, robot: str | None, line: int, explanation: str) -> Finding:
        return Finding(self.name, tick, robot, line, explanation)

    def broken_by(self, record: Record, robot: str | None, explanation: str) -> Finding:
        return Finding(self.name, record.tick, robot, record.line, explanation)
