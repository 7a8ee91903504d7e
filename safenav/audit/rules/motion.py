"""Rules on positions of robots: the map, mobility, obstacles, other robots."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.formulas import rules_of
from safenav.audit.language import RefusedError
from safenav.audit.lines import Line
from safenav.audit.rules.rule import Message, Rule, Wrong, differences, judges
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status, taken
from safenav.audit.world import opposite


@judges("line", "move")
def continuity(record: Line, now: Situation) -> Iterator[Message]:
    """A robot moves from its region: ``from`` is its former ``to``, at first its start (T)."""
    yield from differences(record, now, from_=now.region[record.robot])


@judges("line", "move")
def map_(record: Line, now: Situation) -> Iterator[Message]:
    """Robots stay on the map and out of its walls (D 4: ``region' not in O``)."""
    if not now.grid.is_free(record.to):
        what = "a wall" if now.grid.on_map(record.to) else "not on the map"
        yield f"{record.robot} enters {now.show(record.to)}, which is {what}"


@judges("line", "move")
def mobility(record: Line, now: Situation) -> Iterator[Message]:
    """A move is a stay or a step to a 4-neighbour. With a heading: staying keeps it, a step is not
    backwards, and afterwards the robot faces the direction of the step (D 3, Mobility)."""
    robot, before = record.robot, now.heading[record.robot]
    step = now.grid.direction(record.from_, record.to)
    if now.has_failed(robot):
        if not (now.live or now.external):
            yield f"{robot} ends elsewhere than commanded, in a simulated world"
        return
    if record.to != record.from_ and step is None:
        origin, to = now.show(record.from_), now.show(record.to)
        yield f"{robot} jumps from {origin} to {to}, which is not a neighbour"
    elif not now.has_heading(robot):
        if before is None and record.heading is not None:
            yield f"{robot} has no heading, but then faces {record.heading}"
    elif step is None:
        if record.heading != before:
            yield f"{robot} turns from {before} to {record.heading} while it stays"
    elif before is not None and step == opposite(before):
        yield f"{robot} faces {before} and steps {step}, which is backwards"
    elif record.heading != step:
        yield f"{robot} steps {step} and then faces {record.heading}"


class UnresolvedObstacleRule(Rule):
    """No robot is in the region of an unresolved obstacle that stops it, or in transit to it,
    except a robot that resolves it by entering: one need is left, one robot suffices for it, the
    robot has the action, and the obstacle's region is a resolution region (D 5.1). A trace of an
    external world omits the true state. A run that continues one may begin where an operator has
    put a robot."""

    name, kinds = "unresolved-obstacle", ("move", "resolved")

    def __init__(self) -> None:
        self._open: list[tuple[str, Wrong]] = []
        """Findings, unless their obstacle is resolved in the same tick: an action may have ended
        whose line comes in a later turn."""

    def opening(self, now: Situation) -> Iterator[Message]:
        self._begins = dict(now.region if now.header.begun is not None else {})
        for robot, region in now.region.items() if not self._begins else ():
            for _, problem in _entered(robot, {region}, now, Status.UNRESOLVED):
                if not now.external:
                    yield robot, problem

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type == "resolved":
            self._open = [(name, wrong) for name, wrong in self._open if name != record.obstacle]
        elif not now.external:
            yield from self._over(record)
            regions = taken(record) - {self._begins.get(record.robot)}
            if record.to != self._begins.get(record.robot):
                self._begins.pop(record.robot, None)
            for name, problem in _entered(record.robot, regions, now, Status.UNRESOLVED):
                if now.acting.keys() - {record.robot}:
                    self._open.append((name, (record.robot, problem, record)))
                else:
                    yield problem

    def ending(self, now: Situation) -> Iterator[Message]:
        return (wrong for _, wrong in self._open)

    def _over(self, record: Line) -> list[Wrong]:
        over = [one for one in self._open if one[1][2].tick < record.tick]
        self._open = [one for one in self._open if one not in over]
        return [wrong for _, wrong in over]


@judges("line", "move")
def known_obstacle(record: Line, now: Situation) -> Iterator[Message]:
    """No robot enters a permanent obstacle that stops it, whatever its actions: an obstacle found
    untraversable, or that no robot can resolve, has joined O (D 5.1). A robot of an external world
    may be moved there."""
    if now.external and now.has_failed(record.robot):
        return
    for status in (Status.UNTRAVERSABLE, Status.GIVEN_UP):
        for _, problem in _entered(record.robot, now.entered(record), now, status):
            yield problem


@judges("line", "move")
def way_back(record: Line, now: Situation) -> Iterator[Message]:
    """A robot that has entered a discovered obstacle to resolve it leaves it, until it is resolved,
    only to where it came from. It never enters one on which its actions have failed (D 5.1)."""
    robot, entered = record.robot, now.entered(record)
    if now.has_failed(robot) or not entered:
        return
    for name in now.discovered:
        obstacle = now.obstacles[name]
        there = now.status[name] in _IS and now.is_inside(robot, name)
        if there and not entered <= {now.came[robot], obstacle.region}:
            yield f"{robot} passes {name}, which is not resolved"
        fails = now.status[name] is Status.UNRESOLVED and (robot, name) in now.barred
        if fails and obstacle.region in entered and robot in now.stopped_by(name):
            yield f"{robot} enters {name}, which it has failed to resolve"


class AlwaysRule(Rule):
    """A robot never enters a region that its own objective avoids, and each of its steps satisfies
    the formulas in its ``always`` or, for some values of their memory, those in the ``safety`` of
    its ``ltl``, even while it pursues another objective (D 3). A robot of an
    external world may be moved elsewhere, and before a run continues an operator may have put it
    anywhere."""

    name, kinds = "always", ("move",)

    def opening(self, now: Situation) -> Iterator[Message]:
        for robot, region in now.region.items() if now.header.begun is None else ():
            if region in now.own[robot].avoid:
                yield robot, f"{robot} starts in {now.show(region)}, which it avoids"

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if now.external and (record.by is None or now.has_failed(record.robot)):
            return
        robot, own = record.robot, now.own[record.robot]
        for region in now.entered(record) & own.avoid:
            yield f"{robot} enters {now.show(region)}, which it must avoid"
        to = record.to if record.toward is None else record.toward
        rules = own.always or own.kind == "ltl"
        if not rules or record.from_ == to or now.toward[robot] is not None:
            return  # a step that was begun may be ended under other rules
        faced = now.has_heading(robot)
        before = record.from_, now.heading[robot] if faced else None
        after = to, now.grid.direction(record.from_, to) if faced else None
        try:
            kept = rules_of(own, few=False).allows(before, after)
        except RefusedError:
            return
        if not kept:
            step = f"{robot} steps from {now.show(record.from_)} to {now.show(to)}"
            yield f"{step}, which violates {' and '.join(own.always) or 'its formulas'}"


@judges("line", "move")
def transit(record: Line, now: Situation) -> Iterator[Message]:
    """A robot in transit (a step of several ticks) stays in the region of departure, in transit to
    the same neighbouring free region until it arrives; only a step that may take one tick takes one
    (T, Time). Live, a step that fails ends in
    the region of its ``arrive`` line."""
    bound, robot = now.toward[record.robot], record.robot
    timing = None if now.live or now.external else now.header.robots[robot].timing
    one = bound is record.toward is None and record.to != record.from_
    if one and timing is not None and timing > 1:
        yield f"a step of {robot} takes one tick, and not {timing}"
    over = record.toward is None and not now.has_failed(robot)
    if bound is not None and over and record.to != bound:
        yield f"{robot} was in transit to {now.show(bound)}, but is at {now.show(record.to)}"
    if record.toward is None:
        return
    to = now.show(record.toward)
    if bound is not None and record.toward != bound:
        yield f"{robot} was in transit to {now.show(bound)}, not {to}"
    if record.to != record.from_:
        yield f"{robot} moves while in transit to {to}"
    if now.grid.direction(record.to, record.toward) is None:
        yield f"{robot} is in transit to {to}, which is not a neighbour"
    if not now.grid.is_free(record.toward):
        yield f"{robot} is in transit to {to}, which is not free"


@judges("line", "move")
def collision(record: Line, now: Situation) -> Iterator[Message]:
    """Robots in conflict never share a region, at any moment. A robot in transit occupies two
    regions, a lost robot all regions where it may be. Robots that exchange places share a region,
    because they move one after the other (D 4, Layers)."""
    robot = record.robot
    for other in now.rivals[robot]:
        own, theirs = _held(record, other, now)
        for region in sorted(own & theirs):
            sure = region in taken(record) & now.taken_by(other)
            are = "are both" if sure else "may both be"
            yield f"{robot} and {other} {are} at {now.show(region)}"


@judges("line", "move")
def never_together(record: Line, now: Situation) -> Iterator[Message]:
    """At most one robot of an exclusion is in its regions, from its departure
    for the first to its arrival outside (D 4)."""
    robot = record.robot
    for other in now.region.keys() - {robot} if now.exclusions else ():
        for zone in now.zones(robot, other):
            if all(regions & zone for regions in _held(record, other, now)):
                yield f"{robot} and {other} are together in {sorted(zone)}"


def _held(move: Line, other: str, now: Situation) -> tuple[set[int], set[int]]:
    """Return the regions that two robots keep free of each other after a move of the first. A lost
    robot may be in all its possible regions, and keeps others out of the region from which it
    departed. If the first robot is lost, only the regions of its report count, and likewise those
    of the other. In ticks, if the first ends elsewhere than commanded, the other's unfinished step
    does not count."""
    own, theirs = now.lost.get(move.robot), now.lost.get(other)
    if now.has_failed(move.robot) and not now.live:
        return {move.to}, {now.region[other]}
    if own:
        return set(own), set(theirs or now.taken_by(other))
    return taken(move), now.may_have(other)


_IS = {
    Status.UNRESOLVED: "not resolved",
    Status.UNTRAVERSABLE: "known to be untraversable",
    Status.GIVEN_UP: "permanent: no robot can resolve it",
}


def _entered(
    robot: str, regions: set[int], now: Situation, status: Status
) -> Iterator[tuple[str, str]]:
    """Yield the obstacles with a status that a robot has entered, each with its error."""
    for obstacle in (each for region in regions for each in now.obstacles_at.get(region, ())):
        if now.status[obstacle.name] is status and robot in now.blocked_by(obstacle.name):
            place = now.show(obstacle.region)
            yield (
                obstacle.name,
                f"{robot} is at {place} with {obstacle.name}, which is {_IS[status]}",
            )
