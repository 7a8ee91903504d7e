"""Rules on synthesis: who needs a strategy, and who drives by which."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import RESYNTHESIS, Situation
from safenav.trace.objective import Objective
from safenav.trace.records import (
    Assumption,
    Blocked,
    Move,
    Record,
    Request,
    Resolved,
    Synthesis,
)
from safenav.trace.vocabulary import (
    BlockReason,
    MovedBy,
    Reason,
    RecordedVerdict,
    Verified,
)

_CAUSES: dict[Reason, tuple[type[Resolved | Blocked | Request | Assumption], ...]] = {
    Reason.REQUEST: (Request,),
    Reason.RESOLVED: (Resolved,),
    Reason.BLOCKED: (Blocked, Assumption),
}
_FOR_WHAT_IS_IN_FORCE = (Reason.RESOLVED, Reason.BLOCKED)
"""Reasons that leave no choice of the objective; a request tries several before its push."""

_PROVEN = (RecordedVerdict.REALIZABLE, RecordedVerdict.UNREALIZABLE)


class SynthesisRule(Rule):
    """Before the first move each robot gets a strategy for the objective of the header. Where
    an objective changes, and for a requester that nobody can help, a synthesis follows in the
    same turn (D 5.4 to 5.6, T Time). Its reason has happened in that turn, and its objective is
    in force (or tried, for a request). A realizable one yields a strategy, others do not."""

    name = "synthesis"

    def __init__(self) -> None:
        self._initial: set[str] = set()
        self._begun = False

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Synthesis):
            for problem in self._problems(record, now):
                yield self.broken_by(record, record.robot, problem)
        elif isinstance(record, Move) and not self._begun:
            self._begun = True
            for robot in sorted(now.header.robots.keys() - self._initial):
                problem = f"{robot} has no initial synthesis before the first move"
                yield self.broken_by(record, robot, problem)

    def turn(self, now: Situation) -> Iterator[Finding]:
        turn = now.turn
        for record in () if now.derived else turn.all(Synthesis):
            causes = _CAUSES.get(record.reason)
            if causes and not any(map(turn.first, causes)) and not turn.torn:
                problem = f"a synthesis for the reason {record.reason}, which no line gives"
                yield self.broken_by(record, record.robot, problem)
        if turn.final or turn.robot is None or now.header.coordination != RESYNTHESIS:
            return
        if now.derived:
            return  # a robot may go back to a strategy that it has
        done = {(s.robot, s.objective) for s in turn.all(Synthesis)}
        for robot, objective in now.objectives.items():
            if objective != turn.objectives[robot] and (robot, objective) not in done:
                problem = f"{robot} gets {objective} but no strategy for it"
                yield self.broken(turn.tick, robot, turn.records[-1].line, problem)
        given_up = [b for b in turn.all(Blocked) if b.reason is not BlockReason.UNTRAVERSABLE]
        if given_up and not any(robot == turn.robot for robot, _ in done):
            problem = f"{turn.robot} gets no strategy around {given_up[0].obstacle}"
            yield self.broken_by(given_up[0], turn.robot, problem)

    def _problems(self, record: Synthesis, now: Situation) -> Iterator[str]:
        robot = record.robot
        is_initial = record.reason is Reason.INITIAL
        if is_initial:
            self._initial.add(robot)
            given = now.header.robots[robot].objective
            if record.objective != given:
                yield f"{robot} is to {given}, but the synthesis is for {record.objective}"
        tried = record.reason in _FOR_WHAT_IS_IN_FORCE and not now.derived
        if tried and record.objective != now.objectives[robot]:
            yield f"{robot} is to {now.objectives[robot]}, but gets {record.objective}"
        if is_initial is not (record.tick == 0):
            yield f"a synthesis of tick {record.tick} for the reason {record.reason}"
        if record.verified is Verified.MOVES:
            if record.strategy is not None or record.states is not None:
                yield f"the moves of {robot} are checked one by one, but its strategy is listed"
        elif record.verdict is RecordedVerdict.REALIZABLE and record.strategy is None:
            yield f"the synthesis for {robot} is realizable but gave no strategy"
        if record.verdict is not RecordedVerdict.REALIZABLE and record.strategy is not None:
            yield f"the synthesis for {robot} is {record.verdict} but gave a strategy"


class StrategyRule(Rule):
    """Nobody moves without a strategy: the last synthesis for its objective in force exists,
    was realizable, and its strategy was not refuted (D 1 and 10). Once an assumption was
    violated a robot may hold without one."""

    name = "strategy"

    def __init__(self) -> None:
        self._last: dict[tuple[str, Objective], Synthesis] = {}
        self._excused: set[str] = set()

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Synthesis):
            self._last[record.robot, record.objective] = record
            self._excused.discard(record.robot)
        elif isinstance(record, Assumption):
            self._excused.add(record.robot)
        elif isinstance(record, Move) and record.robot not in self._excused:
            problem = self._problem(record.robot, record.by, now)
            if problem:
                yield self.broken_by(record, record.robot, problem)

    def _problem(self, robot: str, by: MovedBy | None, now: Situation) -> str:
        if by in (MovedBy.PLAN, MovedBy.STAY, MovedBy.BACKTRACK):
            return ""
        objective = now.objectives[robot]
        last = self._last.get((robot, objective))
        if last is None:
            without = now.header.coordination == RESYNTHESIS
            return f"{robot} moves without a strategy for {objective}" if without else ""
        if last.verdict is not RecordedVerdict.REALIZABLE:
            return f"{robot} moves, though {objective} was {last.verdict} in tick {last.tick}"
        if last.verified is False:
            return f"{robot} moves by a strategy that failed its verification in tick {last.tick}"
        return ""


class VerdictsRule(Rule):
    """Equal specifications (by their sha256) are not realizable and unrealizable at once."""

    name = "verdicts"

    def __init__(self) -> None:
        self._proven: dict[str, Synthesis] = {}

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:  # noqa: ARG002
        if isinstance(record, Synthesis) and record.spec and record.verdict in _PROVEN:
            former = self._proven.setdefault(record.spec, record)
            if former.verdict is not record.verdict:
                problem = f"{record.verdict}, but {former.verdict} in line {former.line}"
                yield self.broken_by(record, record.robot, f"this specification is {problem}")
