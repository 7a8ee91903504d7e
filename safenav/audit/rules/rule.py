"""Base class of rules, and their findings."""

# ruff: noqa: ARG002 (a rule answers the questions that concern it and ignores the others)

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import ClassVar

from safenav.audit.lines import Line
from safenav.audit.situation import Situation


@dataclass(frozen=True)
class Finding:
    """A broken rule: its tick, the robot (None: no robot in particular), the line of the trace that
    shows it, and what is wrong in the words of the scenario. ``unknown``: what cannot be judged,
    since it is larger than this check accepts. ``note``: no rule is broken as far as is known, but
    this part of the line was not judged."""

    rule: str
    tick: int
    robot: str | None
    line: int
    explanation: str
    unknown: bool = False
    note: bool = False

    def __str__(self) -> str:
        whom = f", {self.robot}" if self.robot else ""
        return f"line {self.line}: {self.rule} (tick {self.tick}{whom}): {self.explanation}"


class Postponed:
    """Lines missing in a turn of a live run, which may follow when the strategies for them arrive:
    they are missing permanently if no robot waits for a strategy, or acts."""

    def __init__(self) -> None:
        self._open: list[tuple[Finding, Callable[[], bool]]] = []

    def judge(
        self, found: Iterable[tuple[Finding, Callable[[], bool]]], now: Situation
    ) -> Iterator[Finding]:
        """Yield what is missing, of what was ``found`` in this turn and before. Each finding has a
        function that tells whether that has come."""
        if not now.live:
            yield from (finding for finding, _ in found)
            return
        self._open = [one for one in (*self._open, *found) if not one[1]()]
        if now.awaiting or now.acting:  # who acts may wait for a strategy as well
            return
        late = [one for one in self._open if now.turn.tick > one[0].tick + 1]
        self._open = [one for one in self._open if one not in late]
        yield from (finding for finding, _ in late)


class Rule:
    """A condition that must hold for every run. One object checks one trace, and may keep state.

    ``name`` is the rule's name in reports; the docstring states its demand and the source (D: the
    design's section, T: docs/trace.md)."""

    name: ClassVar[str]

    def opening(self, now: Situation) -> Iterable[Finding]:
        """Check the header alone; called once."""
        return ()

    def line(self, record: Line, now: Situation) -> Iterable[str | Finding]:
        """Check a line before it takes effect; called for each line. What is wrong with this line
        and its robot is said in words, anything else is a finding."""
        return ()

    def turn(self, now: Situation) -> Iterable[Finding]:
        """Check a turn that is over (``now.turn``)."""
        return ()

    def ending(self, now: Situation) -> Iterable[Finding]:
        """Check the whole run; called once, after the last line."""
        return ()

    def findings_on(self, record: Line, now: Situation) -> Iterator[Finding]:
        """Return the findings on a line."""
        for found in self.line(record, now):
            about = getattr(record, "robot", None)
            yield self.broken_by(record, about, found) if isinstance(found, str) else found

    def broken(self, tick: int, robot: str | None, line: int, explanation: str) -> Finding:
        return Finding(self.name, tick, robot, line, explanation)

    def not_judged(self, record: Line, robot: str | None, what: str) -> Finding:
        return Finding(self.name, record.tick, robot, record.line, f"not judged: {what}", note=True)

    def broken_by(self, record: Line, robot: str | None, explanation: str) -> Finding:
        return Finding(self.name, record.tick, robot, record.line, explanation)


class LineRule(Rule):
    """A condition on each line of one type (``kind``)."""

    kind: ClassVar[str]

    def line(self, record: Line, now: Situation) -> Iterable[str | Finding]:
        return self.problems(record, now) if record.type == self.kind else ()

    def problems(self, record: Line, now: Situation) -> Iterator[str]:
        """Yield why the line is wrong."""
        raise NotImplementedError
