"""The lines of a live run, expanded: each pass gives every robot the move that it has in lockstep.

A robot that departs is in transit from then on, one that arrives ends its step, all others stay or
remain in transit. So one ``Situation`` serves both kinds of runs. The lines of the trace all stay,
in their order; only moves come in between, with the number of the line that shows them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from safenav.trace.records import (
    Act,
    Acted,
    Arrive,
    Backtrack,
    Belief,
    Depart,
    Discovered,
    Goal,
    Hold,
    Late,
    Met,
    Move,
    NewObjective,
    Operator,
    Outcome,
    Plan,
    PlanEnd,
    Record,
    Resolved,
    Synthesis,
    Violation,
)
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import (
    Ending,
    Heading,
    HoldReason,
    MovedBy,
    OperatorDeed,
    PlanEndReason,
    Region,
)

LIVE = "live"

_DECIDES = (Violation, Backtrack, Depart, Arrive)
"""Lines before the move of a robot's turn, or in its place."""
_FOLLOWS = (Act, Acted, Met, Resolved, Goal, Belief)
_ASIDE = (Discovered, Late, PlanEnd)


def expanded(trace: Trace) -> Trace:
    """A live run with its moves; any other trace as it is."""
    if trace.header.clock != LIVE:
        return trace
    return replace(trace, records=tuple(_Passes(trace).lines()))


def _ends_pass(record: Record) -> bool:
    """Return whether a line comes when all robots have had their turns in a pass."""
    if isinstance(record, PlanEnd):
        return record.reason is PlanEndReason.REACHED
    if isinstance(record, Plan):
        return True
    return isinstance(record, Outcome) and record.outcome is Ending.COMPLETED


class _Passes:
    def __init__(self, trace: Trace) -> None:
        robots = trace.header.scenario.robots
        self._trace = trace
        self._names = list(robots)
        self._region: dict[str, Region] = {n: r.start for n, r in robots.items()}
        self._heading: dict[str, Heading | None] = {n: r.heading for n, r in robots.items()}
        self._toward: dict[str, Depart | None] = dict.fromkeys(robots)
        self._by = dict.fromkeys(robots, MovedBy.STAY)
        self._tick = 0
        self._due = 0
        """Index of the robot whose move is the next of the pass."""
        self._open: Move | None = None
        """The move of the robot whose turn it is, as far as its lines have shown by now."""
        self._begun: set[str] = set()

    def lines(self) -> Iterator[Record]:
        for record in self._trace.records:
            if record.tick > self._tick > 0:
                yield from self._pass_over(record)
            elif _ends_pass(record) and self._tick:
                yield from self._others(record)
            self._tick = record.tick
            if isinstance(record, Act | Depart) and record.robot in self._by:  # held no more
                self._by[record.robot] = MovedBy.STAY
            robot = self._owner(record)
            if robot is not None:
                yield from self._turn_of(robot, record)
            if not isinstance(record, (*_DECIDES, *_ASIDE, Hold)):
                yield from self._moved()
            yield record
            self._take(record)
        yield from self._moved()

    def _owner(self, record: Record) -> str | None:
        """The robot whose turn has come by this line; None if it may be in any turn."""
        name = getattr(record, "robot", None)
        if not isinstance(record, (*_DECIDES, *_FOLLOWS, Hold)) or name not in self._region:
            return None
        if not record.tick:
            return None  # before the first pass
        if isinstance(record, _DECIDES):
            return str(name)
        begins = isinstance(record, Goal) and name in self._begun  # on its target, in any turn
        ahead = self._names.index(name) >= self._due and not begins
        return str(name) if ahead else None

    def _turn_of(self, robot: str, record: Record) -> Iterator[Record]:
        """Let the robots before it move, and begin its turn."""
        if self._open is not None and self._open.robot == robot:
            return
        yield from self._moved()
        if self._names.index(robot) < self._due:  # a second turn in one pass
            yield from self._pass_over(record)
        while self._names[self._due] != robot:
            yield self._stay(record)
        self._open = self._stay(record)
        self._due -= 1

    def _pass_over(self, record: Record) -> Iterator[Record]:
        yield from self._others(record)
        self._due = 0

    def _others(self, record: Record) -> Iterator[Record]:
        """The moves that are left of a pass."""
        yield from self._moved()
        while self._due < len(self._names):
            yield self._stay(record)

    def _stay(self, record: Record) -> Move:
        """The move of the robot that is next, if no line tells another."""
        name = self._names[self._due]
        self._due += 1
        self._begun.clear()
        here, depart = self._region[name], self._toward[name]
        toward = None if depart is None else depart.to
        by = self._by[name] if depart is None else None
        tick = self._tick or record.tick
        return Move(tick, name, here, here, self._heading[name], toward, by, line=record.line)

    def _moved(self) -> Iterator[Record]:
        """The turn's move, as soon as it is certain."""
        if self._open is None:
            return
        move, self._open = self._open, None
        self._due = self._names.index(move.robot) + 1
        self._region[move.robot], self._heading[move.robot] = move.to, move.heading
        yield move

    def _take(self, record: Record) -> None:
        match record:
            case Depart() if self._open is not None:
                self._toward[record.robot] = record
                self._open = replace(self._open, toward=record.to, by=record.by)
                self._open = replace(self._open, busy=record.shown, signal=record.signal)
            case Arrive() if self._open is not None:
                depart, self._toward[record.robot] = self._toward[record.robot], None
                planned = depart is not None and depart.by is MovedBy.PLAN
                by = MovedBy.PLAN if planned else self._open.by
                self._open = replace(
                    self._open, to=record.at, heading=record.heading, toward=None, by=by
                )
            case Hold():
                decided = record.why is HoldReason.STRATEGY
                self._by[record.robot] = MovedBy.STRATEGY if decided else MovedBy.STAY
                if self._open is not None and self._open.toward is None:
                    back = self._open.by is MovedBy.BACKTRACK
                    by = MovedBy.BACKTRACK if back else self._by[record.robot]
                    told = record.signal
                    self._open = replace(self._open, by=by, signal=told, busy=record.shown)
            case Backtrack() if self._open is not None:
                self._open = replace(self._open, by=MovedBy.BACKTRACK)
            case Synthesis() | NewObjective():
                self._begun.add(record.robot)
            case Goal():
                self._begun.discard(record.robot)
            case Operator() if record.deed is OperatorDeed.PUT_BACK and record.robot is not None:
                assert record.region is not None
                self._region[record.robot] = record.region
                self._heading[record.robot] = record.heading
            case _:
                pass
