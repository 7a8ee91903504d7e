"""Rules on obstacles that appear or disappear, and on the changes that robots receive."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Finding, LineRule, Rule
from safenav.audit.situation import Situation
from safenav.audit.turn import Status


class AppearedRule(Rule):
    """An obstacle appears where none of that name is, never on a robot that is there or in transit
    to it, and if the scenario lets it appear, not before its time (T)."""

    name = "appeared"

    def line(self, record: Line, now: Situation) -> Iterator[str | Finding]:
        if record.type != "appeared":
            return
        obstacle = now.obstacles[record.obstacle]
        if now.status[obstacle.name] not in (Status.ABSENT, Status.RESOLVED):
            yield f"{obstacle.name} appears where it already is"
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
                yield f"the scenario does not let {obstacle.name} appear"
            elif _time(record, now) < since:
                yield f"{obstacle.name} appears in tick {record.tick}, before {since}"


class OrderedRule(Rule):
    """An order of the scenario is recorded when it appears, and nothing else in its name; an order
    is in no robot's way (D 5)."""

    name = "ordered"

    def __init__(self) -> None:
        self._appeared: Line | None = None

    def line(self, record: Line, now: Situation) -> Iterator[str | Finding]:
        before, self._appeared = self._appeared, None
        if record.type == "appeared":
            self._appeared = record
        if record.type == "order":
            obstacle = now.obstacles[record.obstacle]
            if before is None or before.obstacle != record.obstacle:
                yield f"{obstacle.name} has not just appeared"
            elif obstacle.blocks:
                yield f"{obstacle.name} is ordered, but stops robots"
            elif not obstacle.ordered:
                yield f"{obstacle.name} is not to be ordered"
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


class ServiceRule(Rule):
    """A robot that is out of service begins no step; it ends a step that it has begun. Each line
    about its service changes that (T)."""

    name = "service"

    def line(self, record: Line, now: Situation) -> Iterator[str]:
        told = record.type == "service" and record.cause != "battery"  # another rule judges that
        if told and record.active is not (record.robot in now.out):
            yield f"{record.robot} is {'in' if record.active else 'out of'} service as before"
        if record.type != "move" or record.robot not in now.out:
            return
        if now.toward[record.robot] is not None:
            return  # it is in transit
        if record.to != record.from_ or record.toward is not None:
            yield f"{record.robot} moves, but is out of service"


class InputsRule(Rule):
    """The inputs are those of the scenario. A simulation has them on in the listed ticks, and off
    in others where no probability is given, unless a user has set them. When a robot moves, it has
    the objective that the inputs give it (D 3)."""

    name = "inputs"

    def __init__(self) -> None:
        self._user: set[str] = set()

    def line(self, record: Line, now: Situation) -> Iterator[str | Finding]:
        known = {each.name for each in now.header.inputs or ()}
        if record.type == "inputs":
            self._user.update(record.user or ())
            if {*record.values} != known:
                yield f"the inputs are {', '.join(sorted(known))}"
        if record.type != "move":
            return
        simulated = not (now.external or now.live)
        listed_inputs = now.header.inputs if simulated else None
        for each in listed_inputs or ():
            listed = any(first <= record.tick <= last for first, last in each.spans or ())
            sure = each.name not in self._user and (listed or not each.probability)
            if sure and now.inputs.get(each.name) is not listed:
                problem = f"{each.name} must be {'on' if listed else 'off'} in tick {record.tick}"
                yield self.broken_by(record, None, problem)
        own, due = now.own[record.robot], now.due(record.robot)
        if now.header.robots[record.robot].when and own != due:
            yield f"{record.robot} has the objective {own}; the inputs give it {due}"


class ChangesRule(Rule):
    """Each robot receives the changes of the scenario at their tick, and no others in the
    scenario's name; a robot that is out of service is not taken out of service again (T)."""

    name = "changes"

    def __init__(self) -> None:
        self._told: list[Line] = []
        self._tick = 0.0

    def line(self, record: Line, now: Situation) -> Iterator[str]:
        if record.type == "move" and not now.live:
            self._tick = record.tick
        elif now.live and record.t is not None:
            self._tick = record.t
        if record.type not in ("objective", "service"):
            return
        if record.cause != "scenario":
            return
        service = record.type == "service"
        told = (None, record.active) if service else (record.objective, None)
        same = [
            change
            for change in now.header.changes or ()
            if (change.at <= (record.t or 0.0) if now.live else change.at == record.tick)
            and (change.robot, change.objective, change.active) == (record.robot, *told)
        ]
        self._told += same
        if not same:
            what = f"{record.robot} gets a change in tick {record.tick}"
            yield f"{what} that the scenario does not list"

    def ending(self, now: Situation) -> Iterator[Finding]:
        for change in now.header.changes or ():
            if change.at > self._tick or change.objective is None or change in self._told:
                continue
            problem = f"{change.robot} does not get its objective of tick {change.at}"
            yield self.broken(change.at, change.robot, now.header_line, problem)
