"""Reads a trace (docs/trace.md) into typed records.

A writer that was killed leaves an incomplete last line: that is told (``cut_off``), not an
error. Any other line that is not what the format says is one diagnostic; all are reported.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from safenav.audit.fields import Fields
from safenav.audit.header_reader import header_of, obstacle_of
from safenav.audit.records import (
    TRACE_VERSIONS,
    Assumption,
    Backtrack,
    Belief,
    Blocked,
    BlockReason,
    Discovered,
    Ending,
    Goal,
    Header,
    Move,
    ObstacleHeader,
    OperatorCause,
    Outcome,
    Pop,
    Push,
    Record,
    Request,
    Resolved,
    Synthesis,
    SynthesisReason,
    Trace,
    Verdict,
    Violation,
)
from safenav.errors import Diagnostic, InputError

_DIAGNOSTIC_LIMIT = 20


def read_trace(path: str | Path) -> Trace:
    """The trace in a file. Raises InputError if it cannot be read or is not a trace."""
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError([Diagnostic(str(path), 0, 0, f"cannot be read: {reason}")]) from error
    return read_bytes(content, str(path))


def read_lines(lines: Iterable[str], source: str = "<trace>") -> Trace:
    """The trace in some lines (with or without their line ends). Raises InputError."""
    whole = "".join(line if line.endswith("\n") else line + "\n" for line in lines)
    return read_bytes(whole.encode("utf-8", "surrogatepass"), source)


def read_bytes(content: bytes, source: str = "<trace>") -> Trace:
    """The trace in some bytes. ``source`` names it in messages. Raises InputError."""
    lines = content.split(b"\n")
    unfinished = lines.pop()  # empty if the last line is complete
    reader = _Reader(source)
    for number, line in enumerate(lines, start=1):
        reader.take(number, line)
    cut_off = False
    if unfinished.strip():
        cut_off = not _is_json(unfinished)
        if not cut_off:
            reader.take(len(lines) + 1, unfinished)
    return reader.trace(cut_off)


class _Reader:
    def __init__(self, source: str) -> None:
        self._source = source
        self._header: Header | None = None
        self._records: list[Record] = []
        self._ignored = 0
        self._diagnostics: list[Diagnostic] = []
        self._headless = False

    def take(self, number: int, content: bytes) -> None:
        if self._headless or not content.strip():
            return
        try:
            data = json.loads(content.decode("utf-8"))
        except (ValueError, RecursionError) as error:
            self._report(number, f"this line is not JSON: {_brief(error)}")
            return
        if not isinstance(data, dict):
            self._report(number, "a line of a trace is a JSON object")
            return
        problems: list[str] = []
        fields = Fields(data, problems)
        kind = fields.text("type")
        if kind == "header":
            self._take_header(number, fields)
        elif self._header is None and not self._diagnostics:
            self._headless = True  # nothing can be checked without it
            self._report(number, "the first line must be the header", "is this a safenav trace?")
        elif kind in _PARSERS:
            record = _PARSERS[kind](number, fields.integer("tick"), fields)
            if isinstance(record, Discovered) and not problems:
                self._announce(record.obstacle, problems)
            if not problems:
                self._records.append(record)
        elif not problems:
            self._ignored += 1
        for problem in problems:
            self._report(number, problem)

    def trace(self, cut_off: bool) -> Trace:
        if self._diagnostics:
            shown = self._diagnostics[:_DIAGNOSTIC_LIMIT]
            hidden = len(self._diagnostics) - len(shown)
            if hidden:
                shown.append(Diagnostic(self._source, 0, 0, f"and {hidden} more such problems"))
            raise InputError(shown)
        if self._header is None:
            raise InputError([Diagnostic(self._source, 0, 0, "the trace is empty")])
        return Trace(self._source, self._header, tuple(self._records), cut_off, self._ignored)

    def _take_header(self, number: int, fields: Fields) -> None:
        if self._header is not None:
            self._report(number, "a second header: a trace holds one run")
            return
        if fields.integer("trace") not in TRACE_VERSIONS and not fields.problems:
            self._headless = True
            self._report(number, "this reader knows versions 1 and 2 of the trace only")
            return
        self._header = header_of(number, fields)

    def _announce(self, obstacle: ObstacleHeader, problems: list[str]) -> None:
        assert self._header is not None, "nothing is read before it"
        if obstacle.name in self._header.obstacles:
            problems.append(f"{obstacle.name} is known already")
            return
        obstacles = {**self._header.obstacles, obstacle.name: obstacle}
        self._header = replace(self._header, obstacles=obstacles)

    def _report(self, number: int, found: str, hint: str = "") -> None:
        self._diagnostics.append(Diagnostic(self._source, number, 1, found, hint))


def _discovered(line: int, tick: int, fields: Fields) -> Discovered:
    return Discovered(line, tick, obstacle_of(line, fields.inner("obstacle")))


def _synthesis(line: int, tick: int, fields: Fields) -> Synthesis:
    return Synthesis(
        line,
        tick,
        robot=fields.text("robot"),
        reason=fields.one_of("reason", SynthesisReason),
        verdict=fields.one_of("verdict", Verdict),
        seconds=fields.number("seconds"),
        states=fields.integer_or_null("states"),
        cached=fields.flag("cached"),
        verified=fields.flag_or_null("verified"),
        spec=fields.text("spec"),
        strategy=fields.text_or_null("strategy"),
        objective=fields.objective("objective"),
        assumptions=fields.texts("assumptions"),
    )


def _move(line: int, tick: int, fields: Fields) -> Move:
    return Move(
        line,
        tick,
        robot=fields.text("robot"),
        origin=fields.integer("from"),
        to=fields.integer("to"),
        heading=fields.heading_or_null("heading"),
        toward=fields.integer("toward") if fields.has("toward") else None,
    )


def _violation(line: int, tick: int, fields: Fields) -> Violation:
    return Violation(
        line,
        tick,
        robot=fields.text("robot"),
        at=fields.integer("at"),
        proposed=fields.integer("proposed"),
        obstacle=fields.text("obstacle"),
        action=fields.text("action"),
    )


def _backtrack(line: int, tick: int, fields: Fields) -> Backtrack:
    return Backtrack(line, tick, robot=fields.text("robot"), to=fields.integer("to"))


def _request(line: int, tick: int, fields: Fields) -> Request:
    return Request(
        line,
        tick,
        obstacle=fields.text("obstacle"),
        requester=fields.text("requester"),
        bids=fields.distances("bids"),
        helper=fields.text_or_null("helper"),
        regions=fields.regions("regions"),
    )


def _push(line: int, tick: int, fields: Fields) -> Push:
    return Push(
        line,
        tick,
        depth=fields.integer("depth"),
        objectives=fields.objectives("objectives"),
        obstacle=fields.text_or_null("obstacle"),
        requester=fields.text_or_null("requester"),
        helper=fields.text_or_null("helper"),
    )


def _pop(line: int, tick: int, fields: Fields) -> Pop:
    return Pop(
        line,
        tick,
        depth=fields.integer("depth"),
        objectives=fields.objectives("objectives"),
        obstacle=fields.text_or_null("obstacle"),
        requester=fields.text_or_null("requester"),
        helper=fields.text_or_null("helper"),
    )


def _resolved(line: int, tick: int, fields: Fields) -> Resolved:
    return Resolved(
        line,
        tick,
        obstacle=fields.text("obstacle"),
        robot=fields.text("robot"),
        at=fields.integer("at"),
        requested=fields.flag("requested"),
        traversable=fields.flag_or_null("traversable"),
    )


def _blocked(line: int, tick: int, fields: Fields) -> Blocked:
    return Blocked(
        line,
        tick,
        obstacle=fields.text("obstacle"),
        robots=frozenset(fields.texts("robots")),
        reason=fields.one_of("reason", BlockReason),
    )


def _goal(line: int, tick: int, fields: Fields) -> Goal:
    return Goal(
        line,
        tick,
        robot=fields.text("robot"),
        goal=fields.count("goal"),
        region=fields.integer("region"),
        round=fields.count("round"),
    )


def _belief(line: int, tick: int, fields: Fields) -> Belief:
    return Belief(
        line,
        tick,
        robot=fields.text("robot"),
        of=fields.text("of"),
        seen=fields.flag("seen"),
        regions=frozenset(fields.regions("regions")),
    )


def _assumption(line: int, tick: int, fields: Fields) -> Assumption:
    return Assumption(line, tick, robot=fields.text("robot"), name=fields.text("name"))


def _outcome(line: int, tick: int, fields: Fields) -> Outcome:
    ending = fields.one_of("outcome", Ending)
    needs_cause = ending is Ending.OPERATOR_NEEDED
    return Outcome(
        line,
        tick,
        outcome=ending,
        explanation=fields.text("explanation"),
        rounds=fields.counts("rounds"),
        ticks=fields.integer("ticks"),
        seconds=fields.number("seconds"),
        syntheses=fields.count("syntheses"),
        synthesis_seconds=fields.number("synthesis_seconds"),
        cause=fields.one_of("cause", OperatorCause) if needs_cause else None,
    )


_PARSERS: dict[str, Callable[[int, int, Fields], Record]] = {
    "synthesis": _synthesis,
    "move": _move,
    "violation": _violation,
    "backtrack": _backtrack,
    "request": _request,
    "push": _push,
    "pop": _pop,
    "discovered": _discovered,
    "resolved": _resolved,
    "blocked": _blocked,
    "goal": _goal,
    "belief": _belief,
    "assumption": _assumption,
    "outcome": _outcome,
}


def _is_json(content: bytes) -> bool:
    try:
        json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError):
        return False
    return True


def _brief(error: Exception) -> str:
    if isinstance(error, json.JSONDecodeError):
        return f"{error.msg} at column {error.colno}"
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is not UTF-8"
    return "too deeply nested" if isinstance(error, RecursionError) else str(error)
