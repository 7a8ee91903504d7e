"""Rules on the objective stack; the rule on helpers derives the objectives in its lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

from safenav.audit.kinds import ALTERNATION
from safenav.audit.lines import Line, Objective
from safenav.audit.possibilities.deriving import can_alternate
from safenav.audit.rules.rule import Message, Postponed, Rule, Wrong, differences, judges
from safenav.audit.run.situation import RESYNTHESIS, Situation
from safenav.audit.run.turn import StackEntry, helpers_of


@judges("line", "push")
def push(record: Line, now: Situation) -> Iterator[Message]:
    """A push adds an entry for an open request, with helpers that have its action, and states each
    robot's new objective, which follows from the known state (D 5.2; see ``helper``)."""
    for problem in differences(record, now, depth=len(now.stack) + 1):
        yield now.turn.robot, problem
    yield from _missing(record.objectives, now)
    name, requester = record.obstacle, record.requester
    ordered = requester is None and name in now.orders
    if requester not in now.requests.get(name, ()) and not ordered:
        problem = f"objectives are pushed for {name or 'nothing'}, "
        yield requester, problem + f"which {requester} does not wait for"
        return
    for robot in sorted({*helpers_of(record)} - now.need(name).able):
        yield robot, f"{robot} helps with {name}, but lacks the action"


@judges("line", "told")
def told(record: Line, now: Situation) -> Iterator[Message]:
    """Only a robot driven by command inputs or joint plans, or out of service, gets another
    objective without a push, a pop or a synthesis; the objective follows from the known state (D
    5.2 and 5.5; see ``helper``)."""
    zones = any(record.robot in zone.robots for zone in now.header.never_together or ())
    if now.header.coordination == RESYNTHESIS and not (
        now.header.robots[record.robot].conflicts
        or record.robot in now.charge
        or record.robot in now.out
        or zones
    ):
        yield f"{record.robot} has no command inputs"


class PopRule(Rule):
    """A pop removes the entry of a request that has ended, at any position in the stack, and states
    each robot's new objective, which follows from the known state (D 5.2; see ``helper``). A robot
    that helped with an obstacle before the push, and helps with it again, gets the stored objective
    if it can still meet it (free mobility). A request that was given up during a wait and then
    reopened has ended, and a new one follows."""

    name, kinds = "pop", ("push", "pop", "reopened")

    def __init__(self) -> None:
        self._owns = set[tuple[str, Objective]]()
        self._again: list[tuple[str, str, Wrong]] = []  # robot, obstacle it may help with
        self._reopened: dict[str, int] = {}  # the line

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type == "push":
            self._owns.update(now.own.items())
            return
        if record.type == "reopened":
            self._reopened[record.obstacle] = record.line
            return
        robot, entry = now.turn.robot, now.entry_of(record)
        before = entry is not None and entry.line < self._reopened.get(record.obstacle, 0)
        if entry is None:
            yield robot, f"no such entry for {record.obstacle} is on the stack"
        for problem in differences(record, now, depth=len(now.stack) - 1):
            yield robot, problem
        if record.obstacle in now.requests and not before:
            yield robot, f"{record.obstacle} is popped, but neither resolved, gone nor given up"
        yield from _missing(record.objectives, now)
        if now.header.coordination == RESYNTHESIS:
            for name, objective in record.objectives.items():
                for helped, stored in self._stored(name, objective, now):
                    message = f"{name} had to {stored} before the push, but gets {objective}"
                    self._again.append((name, helped, (name, message, record)))

    def turn(self, now: Situation) -> Iterator[Message]:
        again = [wrong for robot, one, wrong in self._again if now.named.get(robot) == one]
        self._again.clear()
        yield from again[:1]

    def _stored(
        self, robot: str, objective: Objective, now: Situation
    ) -> Iterator[tuple[str, Objective]]:
        """Yield the stored objectives that a robot should have received instead, each with the
        obstacle that it concerned."""
        own = now.own[robot]
        if objective in (own, now.objectives[robot]) or objective.kind != ALTERNATION:
            return
        over = [entry for entry in now.stack if entry.obstacle not in now.requests]
        found = [
            (entry.helped[robot], entry.before[robot])
            for entry in over
            if robot in entry.before
            and entry.helped.get(robot) in now.requests
            and (robot, entry.before[robot]) not in self._owns
            and entry.before[robot].kind == ALTERNATION
            and entry.before[robot].targets[:1] == objective.targets[:1]
        ]
        again = any(stored.targets == objective.targets for _, stored in found)  # under new rules
        if again or own.kind == "ltl" or now.has_heading(robot):
            return
        yield from (one for one in found if can_alternate(robot, one[1], now))


class MissedPopRule(Rule):
    """The entries of a request that has ended are removed in the same turn or, live, when the
    strategies have arrived (D 5.2). While the team waits they stay, and are removed afterwards."""

    name = "missed-pop"

    def __init__(self) -> None:
        self._reported: list[StackEntry] = []
        self._owed = Postponed()

    def turn(self, now: Situation) -> Iterator[Message]:
        yield from self._owed.judge([*self._missing(now)], now)

    def _missing(self, now: Situation) -> Iterator[tuple[Wrong, Callable[[], bool]]]:
        for entry in () if now.turn.final or now.waits else now.stack:
            if entry.obstacle not in now.requests and entry not in self._reported:
                self._reported.append(entry)
                problem = f"{entry.obstacle} is over, but its entry stays on the stack"
                last = (now.turn, *now.turn.records)[-1]
                yield (now.turn.robot, problem, last), partial(_is_dropped, entry, now)


def _is_dropped(entry: StackEntry, now: Situation) -> bool:
    return entry not in now.stack


def _missing(objectives: Mapping[str, Objective], now: Situation) -> Iterator[Message]:
    for robot in now.header.robots:
        if robot not in objectives:
            yield robot, f"the objective of {robot} is missing"
