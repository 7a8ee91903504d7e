"""Base class of rules, and their findings."""

# ruff: noqa: ARG002 (a rule answers the questions that concern it and ignores the others)

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from safenav.audit.situation import Situation
from safenav.trace.records import Record


@dataclass(frozen=True)
class Finding:
    """A broken rule: its tick, the robot (None: no robot in particular), the line of the trace that
    shows it, and what is wrong in the words of the scenario."""

    rule: str
    tick: int
    robot: str | None
    line: int
    explanation: str

    def __str__(self) -> str:
        whom = f", {self.robot}" if self.robot else ""
        return f"line {self.line}: {self.rule} (tick {self.tick}{whom}): {self.explanation}"


class Rule:
    """A condition that must hold for every run. One object checks one trace, and may keep state.

    ``name`` is the rule's name in reports; the docstring states its demand and the source (D: the
    design's section, T: docs/trace.md)."""

    name: ClassVar[str]

    def opening(self, now: Situation) -> Iterable[Finding]:
        """Check the header alone; called once."""
        return ()

    def line(self, record: Record, now: Situation) -> Iterable[Finding]:
        """Check a line before it takes effect; called for each line."""
        return ()

    def turn(self, now: Situation) -> Iterable[Finding]:
        """Check a turn that is over (``now.turn``)."""
        return ()

    def ending(self, now: Situation) -> Iterable[Finding]:
        """Check the whole run; called once, after the last line."""
        return ()

    def broken(self, tick: int, robot: str | None, line: int, explanation: str) -> Finding:
        return Finding(self.name, tick, robot, line, explanation)

    def broken_by(self, record: Record, robot: str | None, explanation: str) -> Finding:
        return Finding(self.name, record.tick, robot, record.line, explanation)
