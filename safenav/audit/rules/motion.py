"""Rules on robot positions: the map, mobility, obstacles, each other."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.grid import opposite
from safenav.audit.proofs.formulas import UnreadError, rules_of
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation, Status
from safenav.trace.records import Move, Record
from safenav.trace.vocabulary import MoveEnd


class ContinuityRule(Rule):
    """A robot moves from where it was: ``from`` is its former ``to``, at first its start (T)."""

    name = "continuity"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Move) and record.from_ != now.region[record.robot]:
            problem = (
                f"{record.robot} moves from {now.show(record.from_)}, "
                f"but was at {now.show(now.region[record.robot])}"
            )
            yield self.broken_by(record, record.robot, problem)


class MapRule(Rule):
    """Robots stay on the map and out of its walls (D 4: ``region' not in O``)."""

    name = "map"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Move) and not now.grid.is_free(record.to):
            what = "a wall" if now.grid.on_map(record.to) else "not on the map"
            problem = f"{record.robot} enters {now.show(record.to)}, which is {what}"
            yield self.broken_by(record, record.robot, problem)


class MobilityRule(Rule):
    """A move is a stay or a step to a 4-neighbour. With a heading: staying keeps it, a step is not
    backwards, and afterwards the robot faces the direction of the step (D 3, Mobility)."""

    name = "mobility"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Move) and not _failed(record, now):
            problem = self._problem(record, now)
            if problem:
                yield self.broken_by(record, record.robot, problem)

    def _problem(self, move: Move, now: Situation) -> str:
        robot, before = move.robot, now.heading[move.robot]
        way = now.grid.direction(move.from_, move.to)
        if move.to != move.from_ and way is None:
            origin, to = now.show(move.from_), now.show(move.to)
            return f"{robot} jumps from {origin} to {to}, which is not a neighbour"
        if not now.has_heading(robot):
            gained = before is None and move.heading is not None
            return f"{robot} has no heading, but then faces {move.heading}" if gained else ""
        if way is None:
            if move.heading != before:
                return f"{robot} turns from {before} to {move.heading} while it stays"
            return ""
        if before is not None and way == opposite(before):
            return f"{robot} faces {before} and steps {way}, which is backwards"
        if move.heading != way:
            return f"{robot} steps {way} and then faces {move.heading}"
        return ""


class UnresolvedObstacleRule(Rule):
    """No robot is in the region of an unresolved obstacle that stops it, or in transit to it,
    except a robot that resolves it by entering: one need is left, one robot suffices for it, the
    robot has the action, and the obstacle's region is among those where it is performed (D 5.1). A
    trace of an external world omits the true state."""

    name = "unresolved-obstacle"

    def opening(self, now: Situation) -> Iterator[Finding]:
        for robot, region in now.region.items():
            for problem in _unresolved(robot, {region}, now):
                yield self.broken(0, robot, now.header_line, problem)

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Move):
            for problem in _unresolved(record.robot, _taken(record), now):
                yield self.broken_by(record, record.robot, problem)


class KnownObstacleRule(Rule):
    """An obstacle that was found untraversable, or that no robot can resolve, has joined O for the
    robots that it stops, whatever they can do: none of them enters it (D 5.1)."""

    name = "known-obstacle"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Move):
            for status in (Status.UNTRAVERSABLE, Status.GIVEN_UP):
                into = _taken(record) - now.taken_by(record.robot)
                for problem in _entered(record.robot, into, now, status):
                    yield self.broken_by(record, record.robot, problem)


class AlwaysRule(Rule):
    """A robot never enters a region that its own objective avoids, and each of its steps keeps the
    formulas that stand beside it, whatever it does (D 3). A robot of an external world may be
    taken elsewhere."""

    name = "always"

    def opening(self, now: Situation) -> Iterator[Finding]:
        for robot, region in now.region.items():
            if region in now.header.robots[robot].objective.avoid:
                problem = f"{robot} starts in {now.show(region)}, which it avoids"
                yield self.broken(0, robot, now.header_line, problem)

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if not isinstance(record, Move) or (now.external and record.by is None):
            return
        robot, own = record.robot, now.header.robots[record.robot].objective
        for region in (_taken(record) - now.taken_by(robot)) & own.avoid:
            yield self.broken_by(record, robot, f"{robot} enters {now.show(region)}, to be avoided")
        to = record.to if record.toward is None else record.toward
        if not own.always or record.from_ == to or now.toward[robot] is not None:
            return  # a step that was begun may be ended under other rules
        faced = now.has_heading(robot)
        before = record.from_, now.heading[robot] if faced else None
        after = to, now.grid.direction(record.from_, to) if faced else None
        try:
            kept = rules_of(own).allows(before, after)
        except UnreadError:
            return
        if not kept:
            told = f"{robot} steps from {now.show(record.from_)} to {now.show(to)}"
            problem = f"{told}, against {' and '.join(own.always)}"
            yield self.broken_by(record, robot, problem)


class TransitRule(Rule):
    """A step of several ticks: a robot in transit stands where it departed, in transit to one and
    the same neighbouring free region, until it arrives (T, Time). Live: a step that fails ends
    where its ``arrive`` line says."""

    name = "transit"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if not isinstance(record, Move):
            return
        bound, robot = now.toward[record.robot], record.robot
        over = record.toward is None and not _failed(record, now)
        if bound is not None and over and record.to != bound:
            problem = (
                f"{robot} was in transit to {now.show(bound)}, but is at {now.show(record.to)}"
            )
            yield self.broken_by(record, robot, problem)
        if record.toward is None:
            return
        to = now.show(record.toward)
        if bound is not None and record.toward != bound:
            yield self.broken_by(
                record, robot, f"{robot} was in transit to {now.show(bound)}, not {to}"
            )
        if record.to != record.from_:
            yield self.broken_by(record, robot, f"{robot} moves while in transit to {to}")
        if now.grid.direction(record.to, record.toward) is None:
            yield self.broken_by(
                record, robot, f"{robot} is in transit to {to}, which is not a neighbour"
            )
        if not now.grid.is_free(record.toward):
            yield self.broken_by(record, robot, f"{robot} is in transit to {to}, which is not free")


class CollisionRule(Rule):
    """Robots in conflict never share a region, at any moment of a tick; one in transit occupies two
    (D 4, Layers)."""

    name = "collision"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if not isinstance(record, Move):
            return
        taken = _taken(record)
        for other in now.region:
            if other == record.robot or not now.conflict(record.robot, other):
                continue
            for region in sorted(taken & now.taken_by(other)):
                problem = f"{record.robot} and {other} are both at {now.show(region)}"
                yield self.broken_by(record, record.robot, problem)


class NeverTogetherRule(Rule):
    """Of robots that are never together in some regions at most one is in them, from its departure
    for the first to its arrival outside (D 4)."""

    name = "never-together"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Move):
            for other in now.region:
                for zone in now.zones(record.robot, other) if other != record.robot else ():
                    if _taken(record) & zone and now.taken_by(other) & zone:
                        problem = f"{record.robot} and {other} are together in {sorted(zone)}"
                        yield self.broken_by(record, record.robot, problem)


class SwapRule(Rule):
    """Robots of one layer do not change places within a tick (D 4). Turns interleave, so that
    follows from the absence of collisions if the moves are continuous; checked on its own."""

    name = "swap"

    def __init__(self) -> None:
        self._tick = 0
        self._moves: list[Move] = []

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if not isinstance(record, Move):
            return
        if record.tick != self._tick:
            self._tick, self._moves = record.tick, []
        for other in self._moves:
            swapped = (other.from_, other.to) == (record.to, record.from_)
            if not swapped or record.to == record.from_ or other.robot == record.robot:
                continue
            if now.conflict(record.robot, other.robot):
                places = f"{now.show(record.from_)} and {now.show(record.to)}"
                problem = f"{other.robot} and {record.robot} change places, {places}"
                yield self.broken_by(record, record.robot, problem)
        self._moves.append(record)


def _failed(move: Move, now: Situation) -> bool:
    """Return whether a step has ended otherwise than it should, which another rule judges."""
    ended = now.ended.get(move.robot)
    return ended is not None and ended.result is not MoveEnd.ARRIVED


def _taken(move: Move) -> set[int]:
    """Return the regions that a robot occupies after a move."""
    return {move.to} if move.toward is None else {move.to, move.toward}


def _unresolved(robot: str, regions: set[int], now: Situation) -> Iterator[str]:
    return iter(()) if now.external else _entered(robot, regions, now, Status.UNRESOLVED)


def _entered(robot: str, regions: set[int], now: Situation, status: Status) -> Iterator[str]:
    how = {
        Status.UNRESOLVED: "not resolved",
        Status.UNTRAVERSABLE: "known to be untraversable",
        Status.GIVEN_UP: "permanent: no robot can resolve it",
    }
    for obstacle in now.obstacles.values():
        here = obstacle.region in regions and now.status[obstacle.name] is status
        if here and robot in now.blocked_by(obstacle.name):
            place = now.show(obstacle.region)
            yield f"{robot} is at {place} with {obstacle.name}, which is {how[status]}"
