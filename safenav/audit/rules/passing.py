"""Rules on obstacles that appear and disappear."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Finding, LineRule, Rule
from safenav.audit.situation import Situation, Status


class AppearedRule(Rule):
    """An obstacle appears where none of that name is, never on a robot that is there or in transit
    to it, and if the scenario lets it appear, not before its time (T)."""

    name = "appeared"

    def line(self, record: Line, now: Situation) -> Iterator[Finding]:
        if record.type != "appeared":
            return
        obstacle = now.obstacles[record.obstacle]
        if now.status[obstacle.name] not in (Status.ABSENT, Status.RESOLVED):
            yield self.broken_by(record, None, f"{obstacle.name} appears where it already is")
        if record.cause == "battery":
            return  # at a robot, which another rule judges
        for robot in () if obstacle.ordered else now.header.robots:
            if obstacle.region in now.taken_by(robot):
                place = now.show(obstacle.region)
                yield self.broken_by(
                    record, robot, f"{obstacle.name} appears at {place}, where {robot} is"
                )
        if record.cause == "scenario":
            since = min((o.from_ for o in now.listed[obstacle.name] if o.from_), default=None)
            if since is None:
                yield self.broken_by(
                    record, None, f"the scenario does not let {obstacle.name} appear"
                )
            elif _time(record, now) < since:
                problem = f"{obstacle.name} appears in tick {record.tick}, before {since}"
                yield self.broken_by(record, None, problem)


class OrderedRule(Rule):
    """An order of the scenario is recorded when it appears, and nothing else in its name; an order
    is in no robot's way (D 5)."""

    name = "ordered"

    def __init__(self) -> None:
        self._appeared: Line | None = None

    def line(self, record: Line, now: Situation) -> Iterator[Finding]:
        before, self._appeared = self._appeared, None
        if record.type == "appeared":
            self._appeared = record
        if record.type == "order":
            obstacle = now.obstacles[record.obstacle]
            if before is None or before.obstacle != record.obstacle:
                yield self.broken_by(record, None, f"{obstacle.name} has not just appeared")
            elif obstacle.blocks:
                yield self.broken_by(record, None, f"{obstacle.name} is ordered, but stops robots")
            elif not obstacle.ordered:
                yield self.broken_by(record, None, f"{obstacle.name} is not to be ordered")
        elif before is not None and now.obstacles[before.obstacle].ordered:
            yield self.broken_by(before, None, f"{before.obstacle} appears, but is not ordered")


class GoneRule(LineRule):
    """Only an obstacle that is present disappears, and if the scenario lets it disappear, not
    before its time (T)."""

    name, kind = "gone", "gone"

    def problems(self, record: Line, now: Situation) -> Iterator[str]:
        name = record.obstacle
        if now.status[name] in (Status.ABSENT, Status.RESOLVED):
            yield f"{name} disappears, but it is absent"
        if record.cause == "scenario":
            until = min((o.until for o in now.listed[name] if o.until), default=None)
            if until is None:
                yield f"the scenario does not let {name} disappear"
            elif _time(record, now) < until:
                yield f"{name} disappears in tick {record.tick}, before {until}"


def _time(record: Line, now: Situation) -> float:
    """Return the tick of a line; in a live run its seconds."""
    return record.tick if record.t is None or not now.live else record.t
