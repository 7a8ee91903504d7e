"""Expansion of a live run into passes, in which every robot gets one move, as in lockstep.

A robot that departs is in transit from then on, one that arrives ends its step, all others stay or
remain in transit. So one ``Situation`` serves both kinds of runs. All lines of the trace keep their
order; only moves are inserted, with the number of the line that implies them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from safenav.audit.kinds import shape_of
from safenav.audit.lines import Line, Made
from safenav.audit.run.state import State

MOST_SILENT = 1000
"""Limit on consecutive passes without a line: no run reaches it, a damaged file may."""

EITHER = "either"
"""Source of the decision to stay if the robot gets a strategy in this pass: the new strategy or the
previous one."""

_DECIDES = ("violation", "backtrack", "depart", "arrive")
"""Lines before the move of a robot's turn, or in its place."""
_FOLLOWS = ("act", "acted", "met", "resolved", "goal", "belief")
_ASIDE = ("discovered", "late", "plan_end")


def _ends_pass(record: Line) -> bool:
    """Return whether a line ends a pass: it comes after the turns of all robots."""
    reached = record.type == "plan_end" and record.reason == "reached"
    completed = record.type == "outcome" and record.outcome == "completed"
    return reached or completed


def _set_aside(records: Sequence[Line]) -> set[int]:
    """Return the line numbers of requests that are set aside, and of the requests immediately
    before them, which may be served by now. Both are decided after the turns of all robots."""
    found, asked = set[int](), list[Line]()
    for record in records:
        asked = [*asked, record] if record.type == "request" else []
        asked = [each for each in asked if each.tick == record.tick]
        found |= {each.line for each in asked if record.aside} if asked else set()
    return found


class Passes:
    """Expands a trace. ``now``: the state of the run; each line takes effect before the next."""

    def __init__(self, now: State) -> None:
        self._now, self._names = now, [*now.header.robots]
        self._by: dict[str, str | None] = dict.fromkeys(self._names, "stay")
        self._busy: dict[str, tuple[int, ...]] = {}
        self._tick = 0
        self._due = 0
        """Index of the robot that moves next in the pass."""
        self._open: Line | None = None
        """The move of the robot whose turn it is, as far as its lines determine it so far."""
        self._departed = False
        self._begun: dict[str, frozenset[int]] = {}
        """Robots that may meet a target as they begin, with the targets that they have met so."""
        self._fresh: set[str] = set()
        """Robots that get a strategy in this pass: no line states whether they stay before it or by
        it."""

    def expand(self, records: Iterable[Line]) -> Iterator[Line]:
        """Yield the lines with the moves between them."""
        records = [*records]
        aside = _set_aside(records)
        for record in records:
            if record.tick > self._tick > 0:
                yield from self._pass_over(record)
                silent = min(record.tick - self._tick - 1, MOST_SILENT)
                for _ in range(silent):  # strategies may change what they remember
                    self._tick += 1
                    yield from self._pass_over(record)
            begun, self._tick = self._tick, record.tick
            over = _ends_pass(record) and not self._resumes(record)
            if (over or record.line in aside) and begun:
                yield from self._others(record)
            if record.type in ("act", "depart") and record.robot in self._by:  # no longer held
                self._by[record.robot] = "stay"
            robot = self._owner(record)
            if robot is not None:
                yield from self._turn_of(robot, record)
            # A plan ends after a departure in the same turn: with the run, while an operator is
            # waited for, or since the step has failed immediately.
            ends = record.type == "plan_end" and self._departed
            if ends or record.type not in (*_DECIDES, *_ASIDE, "hold"):
                yield from self._moved()
            yield record
            self._take(record)
        yield from self._moved()

    def _resumes(self, record: Line) -> bool:
        """Return whether a plan continues that of the earlier run: it precedes the first turn."""
        first = self._tick == 1 and not self._due and self._open is None
        return record.type == "plan" and self._now.begun.plan is not None and first

    def _owner(self, record: Line) -> str | None:
        """Return the robot whose turn this line belongs to; None if it may belong to any turn."""
        name = getattr(record, "robot", None)
        if record.type not in (*_DECIDES, *_FOLLOWS, "hold") or name not in self._by:
            return None
        if not record.tick:
            return None  # before the first pass
        if record.type in (*_DECIDES, "acted"):
            return str(name)
        begins = record.type == "goal" and record.goal not in self._begun.get(name, {record.goal})
        ahead = self._names.index(name) >= self._due and not begins
        return str(name) if ahead else None

    def _turn_of(self, robot: str, record: Line) -> Iterator[Line]:
        """Complete the turns of earlier robots, and begin the turn of this one."""
        if self._open is not None and self._open.robot == robot:
            return
        yield from self._moved()
        if self._names.index(robot) < self._due:  # a second turn in one pass
            yield from self._pass_over(record)
        while self._names[self._due] != robot:
            yield self._stay(record)
        self._open, self._departed = self._stay(record), False
        self._due -= 1

    def _pass_over(self, record: Line) -> Iterator[Line]:
        yield from self._others(record)
        self._due = 0
        self._fresh.clear()

    def _others(self, record: Line) -> Iterator[Line]:
        """Yield the remaining moves of a pass."""
        yield from self._moved()
        while self._due < len(self._names):
            yield self._stay(record)

    def _stay(self, record: Line) -> Line:
        """Return the move of the next robot if no line shows a different one: it stays."""
        name = self._names[self._due]
        self._due += 1
        self._begun.clear()
        here, toward = self._now.region[name], self._now.toward[name]
        by = self._by[name] if toward is None else None
        by = EITHER if by == "strategy" and name in self._fresh else by
        tick = self._tick or record.tick
        about = {"tick": tick, "t": None, "robot": name, "line": record.line, "signal": None}
        where = {"from_": here, "to": here, "heading": self._now.heading[name], "toward": toward}
        return Made(type="move", **about, **where, by=by, busy=self._busy.get(name))

    def _moved(self) -> Iterator[Line]:
        """Yield the move of the current turn, which no further line can change."""
        if self._open is None:
            return
        move, self._open = self._open, None
        self._due = self._names.index(move.robot) + 1
        yield move

    def _take(self, record: Line) -> None:
        move = self._open
        match record.type:
            case "depart" if move:
                self._departed = True
                self._by[record.robot] = record.by
                move.toward, move.by = record.to, record.by
                move.busy, move.signal = record.shown, record.signal
            case "arrive" if move:
                move.to, move.heading, move.toward = record.at, record.heading, None
                if self._by[record.robot] == "plan":
                    move.by = "plan"
                self._by[record.robot] = "stay"
            case "hold":
                self._by[record.robot] = "strategy" if record.why == "strategy" else "stay"
                self._busy[record.robot] = record.shown
                if move and move.toward is None:
                    move.busy, move.signal = record.shown, record.signal
                    if move.by != "backtrack":
                        move.by = self._by[record.robot]
            case "backtrack" if move:
                move.by = "backtrack"
            case "synthesis" | "objective" | "told":
                self._begun[record.robot] = frozenset()
                if record.type == "synthesis":
                    self._fresh.add(record.robot)
            case "operator" if record.intervention == "put_back":
                self._begun[record.robot] = frozenset()
            case "goal" if (met := self._begun.pop(record.robot, None)) is not None:
                if shape_of(self._now.objectives[record.robot].kind).covers:
                    self._begun[record.robot] = met | {record.goal}  # other targets may be met too
