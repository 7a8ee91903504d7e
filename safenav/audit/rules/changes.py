"""Rules on obstacles that appear or disappear, and on changes by the scenario."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Message, Rule, judges
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import moment, taken


def _tick_begins(move: Line, now: Situation) -> bool:
    """Return whether a move is the first of a tick in a simulated world: all that the scenario
    changes in that tick has changed."""
    return not now.external and move.robot == next(iter(now.header.robots))


@judges("line", "appeared", "move")
def appeared(record: Line, now: Situation) -> Iterator[Message]:
    """An obstacle appears only if none of its name is present, never in a region that a robot
    occupies, and if the scenario lets it appear, not before its time. In a simulated world it
    appears at its time, or as soon as no robot or other obstacle is there (T)."""
    if record.type == "move":
        time = now.time if now.live else record.tick
        for one in now.coming if _tick_begins(record, now) else ():
            due = one.from_ <= time and (one.until is None or time < one.until)
            if due and now.status[one.name].away and (one.ordered or not _taken(one, now)):
                yield None, f"{one.name} does not appear by tick {record.tick}"
        return
    obstacle = now.obstacles[record.obstacle]
    if not now.status[obstacle.name].away:
        yield f"{obstacle.name} appears where it already is"
    if record.cause == "battery":
        return  # another rule judges it
    yield from _by_a_simulation(record, now)
    for robot in () if obstacle.ordered else now.header.robots:
        if obstacle.region in now.taken_by(robot):
            place = now.show(obstacle.region)
            yield robot, f"{obstacle.name} appears at {place}, where {robot} is"
    if record.cause == "scenario":
        since = next((one.from_ for one in now.coming if one.name == record.obstacle), None)
        if since is None:
            yield f"the scenario does not let {obstacle.name} appear"
        elif moment(record) < since:
            yield f"{obstacle.name} appears in tick {record.tick}, before {since}"


def _by_a_simulation(record: Line, now: Situation) -> Iterator[Message]:
    """A simulated world in ticks changes only what the scenario or a user changes."""
    if record.cause == "world" and not (now.external or now.live):
        yield f"a simulated world changes {record.obstacle}, which the scenario does not"


def _taken(obstacle: Line, now: Situation) -> bool:
    """Return whether a robot or another obstacle, not an order, is in an obstacle's region."""
    others = (o for o in now.obstacles_at[obstacle.region] if now.status[o.name].unmet)
    here = (obstacle.region in now.taken_by(robot) for robot in now.header.robots)
    return any(here) or not all(other.ordered for other in others)


@judges("line")
def ordered(record: Line, now: Situation) -> Iterator[Message]:
    """An order of the scenario is recorded when it appears, and no other obstacle is recorded as
    one; an order blocks no robot (D 5)."""
    before = next((line for line in now.turn.records[-1:] if line.type == "appeared"), None)
    if record.type == "order":
        obstacle = now.obstacles[record.obstacle]
        if before is None or before.obstacle != record.obstacle:
            yield f"{obstacle.name} has not just appeared"
        elif obstacle.blocks:
            yield f"{obstacle.name} is an order, but blocks robots"
        elif not obstacle.ordered:
            yield f"the scenario does not order {obstacle.name}"
    elif before is not None and now.obstacles[before.obstacle].ordered:
        yield None, f"{before.obstacle} is an order, but its 'order' line is missing", before


@judges("line", "gone", "move")
def gone(record: Line, now: Situation) -> Iterator[Message]:
    """Only an obstacle that is present disappears; if the scenario lets it disappear, not before
    its time, and in a simulated world at its time (T)."""
    if record.type == "move":
        time = now.time if now.live else record.tick
        for name, until in now.until.items() if _tick_begins(record, now) else ():
            if until <= time and not now.status[name].away:
                yield None, f"{name} does not disappear by tick {record.tick}"
        return
    yield from _by_a_simulation(record, now)
    name = record.obstacle
    if now.status[name].away:
        yield f"{name} disappears, but it is absent"
    elif record.cause == "scenario":
        until = now.until.get(name)
        if until is None:
            yield f"the scenario does not let {name} disappear"
        elif moment(record) < until:
            yield f"{name} disappears in tick {record.tick}, before {until}"


@judges("line", "service", "move")
def service(record: Line, now: Situation) -> Iterator[Message]:
    """A robot out of service begins no step, but ends a step that it has begun. In a user's world
    it may be moved elsewhere. Each line about its service changes it (T)."""
    robot = record.robot
    if record.type == "service":
        judged = record.cause != "battery"  # another rule judges that
        if judged and record.active is not (robot in now.out):
            yield f"{robot} was already {'in' if record.active else 'out of'} service"
    elif now.has_failed(robot):
        return
    elif robot in now.out and now.toward[robot] is None and taken(record) != {record.from_}:
        yield f"{robot} moves, but is out of service"


class InputsRule(Rule):
    """The inputs are those of the scenario. A simulation has them on in the listed ticks, and off
    in others, unless a user has set them. When a robot moves, it has the objective that the inputs
    assign (D 3)."""

    name, kinds = "inputs", ("inputs", "move")

    def __init__(self) -> None:
        self._user: set[str] = set()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        known = {each.name for each in now.header.inputs or ()}
        if record.type == "inputs":
            if now.repeats_inputs(record) and self._user.issuperset(record.user or ()):
                yield "the inputs are as before"
            self._user.update(record.user or ())
            if {*record.values} != known:
                yield f"the inputs are {', '.join(sorted(known))}"
            return
        simulated = not (now.external or now.live)
        for each in (now.header.inputs or ()) if simulated else ():
            listed = any(first <= record.tick <= last for first, last in each.spans or ())
            if each.name not in self._user and now.inputs.get(each.name) is not listed:
                on = "on" if listed else "off"
                yield None, f"{each.name} must be {on} in tick {record.tick}"
        own, due = now.own[record.robot], now.due(record.robot)
        if now.header.robots[record.robot].when and own != due:
            yield f"{record.robot} has the objective {own}; the inputs give it {due}"


class ChangesRule(Rule):
    """Each robot receives the changes of the scenario at their tick, and no others are recorded as
    changes of the scenario; a robot out of service is not taken out of service again (T)."""

    name, kinds = "changes", ("move", "objective", "service")

    def __init__(self) -> None:
        self._applied: list[Line] = []
        self._served: dict[str, int] = {}

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        robot, service = record.robot, record.type == "service"
        if record.type == "move":
            first = robot == next(iter(now.region))  # all changes of its tick come before it
            yield from self._missing(record, now) if first else ()
            return
        if service:
            self._served[robot] = record.tick
        elif record.at_once and now.objectives[robot] != now.own[robot]:
            yield f"{robot} has another duty, so it cannot change its objective yet"
        if record.cause != "scenario":
            return
        change = (None, record.active) if service else (record.objective, None)
        same = [
            one
            for one in now.header.changes or ()
            if (one.at <= (record.t or 0.0) if now.live else one.at == record.tick)
            and (one.robot, one.objective, one.active) == (robot, *change)
            and one not in self._applied
        ]
        self._applied += same
        if not same:
            yield f"{robot} gets a change in tick {record.tick} that the scenario does not list"

    def _missing(self, move: Line, now: Situation) -> Iterator[Message]:
        time = now.time if now.live else move.tick
        due = [
            one for one in now.header.changes or () if one.at <= time and one not in self._applied
        ]
        self._applied += due
        for one in due:
            again = now.live or self._served.get(one.robot) == move.tick  # changed since
            if one.objective is not None:
                yield one.robot, f"{one.robot} does not get its objective of tick {one.at}"
            elif not again and one.active is (one.robot in now.out):
                yield one.robot, f"the service of {one.robot} does not change in tick {one.at}"
