"""Rules on the objective stack."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import RESYNTHESIS, Situation
from safenav.trace.objective import Objective
from safenav.trace.records import (
    Pop,
    Push,
    Record,
    Request,
    Told,
)


class PushRule(Rule):
    """A push follows its request and adds one entry. The requester holds, the helper is given
    the resolution regions as a target, the others keep their objectives (D 5.5)."""

    name = "push"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Push):
            for robot, problem in self._problems(record, now):
                yield self.broken_by(record, robot, problem)

    def _problems(self, record: Push, now: Situation) -> Iterator[tuple[str | None, str]]:
        who = now.turn.robot
        if record.depth != len(now.stack) + 1:
            yield who, f"the stack is {len(now.stack) + 1} deep after the push, not {record.depth}"
        yield from _missing(record.objectives, now)
        if record.obstacle is None:
            return  # a robot makes way: not an answer to a request
        requests = now.turn.all(Request)  # a second one replaces a helper
        request = requests[-1] if requests else None
        if now.derived:
            yield from self._derived(record, now)
            return
        why = (record.obstacle, record.requester, record.helper)
        if request is None or why != (request.obstacle, request.requester, request.helper):
            yield who, f"objectives are pushed for {record.obstacle} without such a request"
            return
        if now.header.coordination == RESYNTHESIS:
            yield from self._tasks(record, request, now)

    def _derived(self, record: Push, now: Situation) -> Iterator[tuple[str | None, str]]:
        """Since version 2: what is pushed is a duty for an obstacle that was met."""
        if record.obstacle is None:
            return
        if record.obstacle not in now.discovered or now.is_over(record.obstacle):
            problem = f"objectives are pushed for {record.obstacle}, which nobody waits for"
            yield record.requester, problem
        able = now.capable(record.obstacle)
        for robot in sorted({*(record.helpers or ()), *([record.helper] if record.helper else [])}):
            if robot not in able:
                yield robot, f"{robot} is to help with {record.obstacle}, but lacks the action"

    def _tasks(self, record: Push, request: Request, now: Situation) -> Iterator[tuple[str, str]]:
        for robot, objective in record.objectives.items():
            if robot in (record.helper, record.requester) and _both_formulas(robot, record, now):
                continue  # raw formulas keep their safety and get another goal: not judged
            if robot == record.helper:
                if objective == now.objectives[robot] and _serves_already(record, now):
                    continue  # it goes on with that, or waits for what it asked for on the way
                where = set(request.regions)
                if not any(target <= where for target in objective.targets):
                    yield robot, f"{robot} is to resolve {record.obstacle}, but gets {objective}"
            elif robot == record.requester:
                if objective.kind != "hold":
                    yield robot, f"{robot} waits for {record.obstacle}, but gets {objective}"
            elif objective != now.objectives[robot] and objective != _own(robot, record, now):
                yield robot, f"{robot} has no part in this, but gets {objective}"


class ToldRule(Rule):
    """Who is told by signals to do something else, without a push or a pop, gets its own objective
    back; or, while a request is open, it waits or goes where its action is needed (D 5.5)."""

    name = "told"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if not isinstance(record, Told):
            return
        robot, objective = record.robot, record.objective
        if now.header.coordination == RESYNTHESIS:
            yield self.broken_by(record, robot, f"{robot} is told by no signals")
        elif objective == now.header.robots[robot].objective:
            return
        elif not now.stack:
            problem = f"{robot} is told to {objective}, though nobody waits for anything"
            yield self.broken_by(record, robot, problem)
        elif objective.kind not in ("hold", "ltl") and not _helps(robot, objective, now):
            yield self.broken_by(
                record, robot, f"{robot} has no part in this, but gets {objective}"
            )


def _helps(robot: str, objective: Objective, now: Situation) -> bool:
    """Whether the objective leads to where the robot's action is needed for an open request."""
    for entry in now.stack:
        if entry.obstacle is None or now.is_over(entry.obstacle):
            continue
        where = set(now.need(entry.obstacle).regions)
        able = robot in now.capable(entry.obstacle)
        if able and any(target <= where for target in objective.targets):
            return True
    return False


def _serves_already(record: Push, now: Situation) -> bool:
    """Whether the helper was asked for this obstacle before, by somebody else."""
    asked = (record.obstacle, record.helper)
    return any((entry.obstacle, entry.helper) == asked for entry in now.stack)


def _own(robot: str, record: Push, now: Situation) -> Objective | None:
    """What a helper that is replaced did before it was asked for this."""
    asked = (record.obstacle, record.requester, robot)
    entries = (f for f in now.stack if (f.obstacle, f.requester, f.helper) == asked)
    entry = next(entries, None)
    return None if entry is None else entry.before[robot]


def _both_formulas(robot: str, record: Push, now: Situation) -> bool:
    return record.objectives[robot].kind == now.objectives[robot].kind == "ltl"


class PopRule(Rule):
    """A pop drops the top entry, whose obstacle is resolved or given up, and puts back in force
    what was in force before its push (D 5.6)."""

    name = "pop"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Pop):
            for robot, problem in self._problems(record, now):
                yield self.broken_by(record, robot, problem)

    def _problems(self, record: Pop, now: Situation) -> Iterator[tuple[str | None, str]]:
        who = now.turn.robot
        if not now.stack:
            yield who, "nothing is on the stack to be popped"
            return
        entry = now.entry_of(record) or now.stack[-1]
        if record.depth != len(now.stack) - 1:
            yield who, f"the stack is {len(now.stack) - 1} deep after the pop, not {record.depth}"
        why = (entry.obstacle, entry.requester, entry.helper)
        if (record.obstacle, record.requester, record.helper) != why:
            yield who, f"the top of the stack is {_told(entry.obstacle)} of line {entry.line}"
        if now.derived:
            return
        if not now.is_over(entry.obstacle):
            yield who, f"{entry.obstacle} is popped, but is neither resolved nor given up"
        yield from _missing(record.objectives, now)
        for robot, objective in record.objectives.items():
            if objective != entry.before[robot]:
                was = entry.before[robot]
                yield robot, f"{robot} had {was} before the push, and now gets {objective}"


class MissedPopRule(Rule):
    """A entry whose obstacle is resolved or given up is dropped as soon as it is on top
    (D 5.6)."""

    name = "missed-pop"

    def turn(self, now: Situation) -> Iterator[Finding]:
        if now.turn.final or not now.stack:
            return
        entry = now.stack[-1]
        if entry.obstacle is not None and now.is_over(entry.obstacle):
            problem = f"{entry.obstacle} is done with, but stays on top of the stack"
            yield self.broken(now.turn.tick, now.turn.robot, _last_line(now), problem)


def _missing(
    objectives: Mapping[str, Objective], now: Situation
) -> Iterator[tuple[str | None, str]]:
    for robot in now.header.robots:
        if robot not in objectives:
            yield robot, f"it is not said what {robot} has to do"


def _told(obstacle: str | None) -> str:
    return obstacle or "the entry"


def _last_line(now: Situation) -> int:
    records = now.turn.records
    return records[-1].line if records else now.turn.line
