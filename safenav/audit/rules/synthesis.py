"""Rules on synthesis: the robots that need a strategy, and the strategy that drives each."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.kinds import ALTERNATION, STAYING, shape_of
from safenav.audit.lines import Line, Objective
from safenav.audit.rules.rule import Message, Rule
from safenav.audit.run.situation import RESYNTHESIS, Situation
from safenav.audit.run.turn import SCENARIO_CHANGES, is_of_user

_CAUSES: dict[str, tuple[str, ...]] = {
    "request": ("violation", "request", "met", "acted"),
    "resolved": ("resolved",),
    "gone": ("gone",),
    "service": ("service", "operator"),
    "objective": ("objective",),
}
_BEGINS = ("move", "depart", "act", "outcome")
"""Lines that follow all decisions on the reports and changes of the first tick."""


class SynthesisRule(Rule):
    """Before the first move each robot without rivals is synthesized for the objective of the
    header, and never later with that reason. If a run that continues another begins with a wait, a
    robot may be synthesized to stay instead. A robot that gets another objective is synthesized for
    it in the same turn, unless it shares its floor with others (a joint plan is then its
    controller), has command inputs, is out of service, or the run is live; the event that the
    reason names has happened in that turn (D 5.3, T Time). Only a realizable synthesis yields a
    strategy. A strategy begins with a memory that the robot's formulas may have at that pose after
    the steps so far."""

    name = "synthesis"

    def __init__(self) -> None:
        self._initial: set[str] = set()
        self._staying: list[tuple[str, str, Line]] = []
        self._happened: set[str] = set()
        self._begun = False
        self._resumed = -1
        """The tick in which the team decided again because a wait ended."""

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        self._happened.add(record.type)
        changed = record.type == "objective" or is_of_user(record)  # the team then decides again
        if changed or now.ends_wait(record):
            self._resumed = record.tick
        if self._staying and (record.tick > 1 or record.type in _BEGINS):
            excused = self._happened & {"waiting", *SCENARIO_CHANGES}  # decided in the first tick
            yield from () if excused else self._staying
            self._staying = []
        if record.type == "synthesis":
            yield from self._problems(record, now)
        elif record.type == "move" and not self._begun:
            self._begun = True
            lone = {robot for robot in now.header.robots if not now.rivals[robot]}
            for robot in sorted(lone - self._initial):
                yield robot, f"{robot} has no initial synthesis before the first move"

    def turn(self, now: Situation) -> Iterator[Message]:
        turn = now.turn
        if turn.torn:
            return
        for record in turn.all("synthesis"):
            causes = _CAUSES.get(record.reason)
            if record.reason == "request" and any(now.open[name].done for name in now.requests):
                continue  # a robot has done its part of a need
            ends = shape_of(now.own[record.robot].kind).ends and now.has_heading(record.robot)
            if record.reason == "request" and ends and turn.first("goal"):
                continue  # after meeting its own target it serves an obstacle
            later = now.live and self._resumed >= 0
            if record.reason == "service" and (later or self._resumed == record.tick):
                continue  # any change may have ended the wait
            again = self._resumed == record.tick and turn.first("waiting")
            if record.reason == "request" and again:
                continue  # the team waits again: a decision without effect records no request
            if now.live and causes and self._happened & {*causes}:
                continue  # its strategy may have come later
            if causes and not any(map(turn.first, causes)):
                problem = f"a synthesis for the reason {record.reason}, which no line records"
                yield record.robot, problem, record
        if turn.robot is None or turn.final or now.header.coordination != RESYNTHESIS or now.live:
            return  # live, a strategy may come later: StrategyRule judges each move
        if now.waits:
            return  # no search until something changes
        done = {(s.robot, s.objective) for s in turn.all("synthesis")}
        for robot, objective in now.objectives.items():
            same = _alternating(objective) == _alternating(turn.objectives[robot])
            owed = not same and robot not in now.out  # otherwise it is due on the robot's return
            planned = now.rivals[robot] or robot in now.charge  # a joint plan is its controller
            owed = owed and not planned
            if owed and (robot, objective) not in done:
                yield robot, f"{robot} gets {objective} but no strategy for it", turn.records[-1]

    def _problems(self, record: Line, now: Situation) -> Iterator[Message]:
        robot = record.robot
        is_initial = record.reason == "initial"
        if is_initial:
            self._initial.add(robot)
            if record.objective != now.own[robot]:
                message = (
                    f"{robot} must {now.own[robot]}, but the synthesis is for {record.objective}"
                )
                if now.header.begun is None or not _stays(robot, record.objective, now):
                    yield message
                elif record.verdict == "realizable":
                    self._staying.append((robot, message, record))
        if is_initial is not (record.tick == 0):
            yield f"a synthesis of tick {record.tick} for the reason {record.reason}"
        if record.verdict == "realizable" and record.strategy is None:
            yield f"the synthesis for {robot} is realizable but gave no strategy"
        if record.verdict != "realizable" and record.strategy is not None:
            yield f"the synthesis for {robot} is {record.verdict} but gave a strategy"
        chosen = now.memories.chosen(record, now)
        if chosen is not None and not now.memories.may_become(robot, record.memory, now):
            yield f"the strategy of {robot} begins with {record.memory}, which it cannot remember"


def _stays(robot: str, objective: Objective, now: Situation) -> bool:
    """Return whether an objective is to stay where a robot begins; formulas may require that."""
    here = frozenset({now.header.robots[robot].start})
    return objective.kind == "ltl" or (objective.kind == STAYING and {*objective.targets} == {here})


class StrategyRule(Rule):
    """No robot moves without a strategy: the last synthesis for its objective in force exists, was
    realizable, and its strategy was not refuted (D 1 and 10). A strategy for alternation between
    the same targets also suffices. A verdict other than realizable does not count once the obstacle
    that it treats as closed is gone, nor if a robot with command inputs is left out of a request:
    the earlier strategy suffices again. After an assumption was violated, a robot may hold without
    a strategy."""

    name, kinds = "strategy", ("synthesis", "assumption", "move", "gone", "resolved")

    def __init__(self) -> None:
        self._last: dict[tuple[str, Objective], Line] = {}
        self._kept: dict[tuple[str, Objective], Line] = {}
        """The last realizable synthesis."""
        self._alike: dict[tuple[str, tuple[str, object]], Line] = {}
        self._excused: set[str] = set()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type == "synthesis":
            key = record.robot, record.objective
            left_out = record.reason == "request" and record.verdict != "realizable"
            if left_out and now.header.coordination != RESYNTHESIS and key in self._kept:
                return
            self._last[key] = record
            self._alike[record.robot, _alternating(record.objective)] = record
            if record.verdict == "realizable":
                self._kept[key] = record
            self._excused.discard(record.robot)
        elif record.type == "assumption":
            self._excused.add(record.robot)
        elif record.type in ("gone", "resolved"):
            shut = f"obstacles.{record.obstacle}"
            for key, last in self._last.items():
                if key in self._kept and any(name == shut for _, name in last.closed or ()):
                    self._last[key] = self._kept[key]
        elif record.robot not in self._excused:
            yield from self._moved(record.robot, record.by, now)

    def _moved(self, robot: str, by: str | None, now: Situation) -> Iterator[Message]:
        if by in ("plan", "stay", "backtrack"):
            return
        if by is None and (now.live or now.toward[robot] is not None):
            return  # it continues a step that was judged at its departure
        objective = now.objectives[robot]
        alike = self._alike.get((robot, _alternating(objective)))
        last = self._last.get((robot, objective), alike)
        if last is None:
            if now.header.coordination == RESYNTHESIS:
                yield f"{robot} moves without a strategy for {objective}"
        elif last.verdict != "realizable":
            yield f"{robot} moves, though {objective} was {last.verdict} in tick {last.tick}"
        elif last.verified is False:
            yield f"{robot} moves by a strategy that failed its verification in tick {last.tick}"


class VerdictsRule(Rule):
    """No specification (identified by its sha256) is both realizable and unrealizable."""

    name, kinds = "verdicts", ("synthesis",)

    def __init__(self) -> None:
        self._proven: dict[str, Line] = {}

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.spec and record.verdict in ("realizable", "unrealizable"):
            former: Line = self._proven.setdefault(record.spec, record)
            if former.verdict != record.verdict:
                before = f"{former.verdict} in line {former.line}"
                yield f"this specification is {record.verdict}, but {before}"


def _alternating(objective: Objective) -> tuple[str, object]:
    """Return the objective as plain alternation, which is also the weaker form of a strict one."""
    shape = shape_of(objective.kind)
    if shape.recurs and shape.in_turn:
        return ALTERNATION, objective.targets
    return objective.kind, objective.body
