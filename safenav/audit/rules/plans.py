"""Rules on joint plans: their contents, and the moves that follow them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from itertools import combinations, islice, pairwise
from math import inf

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Message, Rule, judges
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status

Left = tuple[dict[str, tuple[Line, ...]], set[tuple[str, int, str, int]]]
"""The rest of a plan: places of each robot, the present one first, and the orders between them."""


@judges("line", "plan")
def plan(record: Line, now: Situation) -> Iterator[Message]:
    """A joint plan begins with the poses of its robots, consists of steps that they can take,
    enters no region known to be closed to them, and its orders keep robots in conflict apart for
    any duration of the steps (T)."""
    for robot, places in record.robots.items():
        for problem in islice(_path_problems(robot, places, now), 1):
            yield robot, problem
    for first, i, then, j in record.orders:
        for robot, index in ((first, i), (then, j)):
            if not index < len(record.robots.get(robot, ())):
                yield robot, f"an order names place {index} of {robot}, which does not exist"
                return
    yield from islice(_meetings(record, now), 1)


_NOT_ENDED = "all steps of the plan were taken, but no line ends it"


class FollowsPlanRule(Rule):
    """While a plan is in force, its robots take its steps and no others, each only when the orders
    allow it. Live, a robot that has taken all its steps may enter regions that no robot in conflict
    has ahead. A plan ends before the next one begins: as ``reached`` when all its steps were taken,
    otherwise for a reason recorded in the same turn (T)."""

    name, kinds = "follows-plan", ("plan", "plan_end", "move")

    def __init__(self) -> None:
        self._running: _Running | None = None

    def left(self) -> Left | None:
        """Return the rest of the plan in force; None if there is no plan, or all robots have
        arrived."""
        running = self._running
        if running is None:
            return None
        at, plan = running.at, running.plan
        rest = {robot: places[at[robot] :] for robot, places in plan.robots.items()}
        orders = {(one, i - at[one], other, j - at[other]) for one, i, other, j in plan.orders}
        left = {order for order in orders if order[1] > 0 and order[3] > 0}
        return (rest, left) if any(len(places) > 1 for places in rest.values()) else None

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        match record.type:
            case "plan":
                if self._running is not None:
                    yield f"a plan begins before that of line {self._running.plan.line} has ended"
                self._running = _Running(record, dict.fromkeys(record.robots, 0))
            case "plan_end":
                yield from self._ended(record, now)
                self._running = None
            case "move" if self._running is not None and self._running.over < record.tick:
                yield None, _NOT_ENDED
                self._running = None
            case "move" if self._running is not None and record.robot in self._running.at:
                if problem := self._running.problem(record, now):
                    yield problem
            case "move" if record.by == "plan" and now.toward[record.robot] is None:
                yield f"{record.robot} is recorded to move by a plan, but is in none"

    def ending(self, now: Situation) -> Iterator[Message]:
        if self._running is not None and self._running.over < inf and not now.is_cut_short():
            yield _NOT_ENDED

    def _ended(self, record: Line, now: Situation) -> Iterator[Message]:
        running = self._running
        if running is None:
            yield "a plan ends, but none is in force"
        elif record.reason == "reached":
            for robot, places in running.plan.robots.items():
                left = len(places) - 1 - running.at[robot]
                if left > 0:
                    yield robot, f"the plan is reached, but {robot} still has {left} steps"
        elif record.reason == "violation" and now.turn.first("violation") is None:
            if now.turn.failed or any(map(now.has_failed, now.ended)):
                return  # its violation follows
            yield "the plan ends by a violation that no line reports"


@dataclass
class _Running:
    """A plan in force. ``at``: index of each robot's place; ``bound``: robots in transit."""

    plan: Line
    at: dict[str, int]
    bound: set[str] = field(default_factory=set)
    over: float = inf
    """The tick in which the last step was taken."""

    def problem(self, move: Line, now: Situation) -> str:
        """Return the error of a move, or an empty text; advance the robot in either case."""
        robot, places = move.robot, self.plan.robots[move.robot]
        entered = move.to if move.toward is None else move.toward
        there = [place for place, _ in places[self.at[robot] + 1 :][:1]]
        if now.has_failed(robot) and (move.to not in there or not now.live):
            self.bound.discard(robot)
            return ""  # its step has failed
        if entered == now.region[robot]:
            return ""
        if self.at[robot] == 0 and entered == places[0][0]:
            return ""  # it ends the step that it took when the plan began
        index = self.at[robot] + 1
        if index >= len(places):
            ahead = now.toward[robot] is None and self._ahead(robot, entered, now)
            if now.live and not ahead and move.by != "plan":
                return ""  # it continues with its strategy
            return f"{robot} continues to {now.show(entered)} after its last place of the plan"
        region, heading = places[index]
        problem = ""
        if entered != region:
            problem = f"{robot} goes to {now.show(entered)}; the plan says {now.show(region)}"
        elif move.toward is None and move.heading != heading:
            problem = f"{robot} then faces {move.heading}; the plan says {heading}"
        elif robot not in self.bound:
            problem = self._too_early(robot, index)
        if move.toward is None:
            self.at[robot] = index
            self.bound.discard(robot)
            if all(self.at[name] + 1 == len(way) for name, way in self.plan.robots.items()):
                self.over = move.tick
        else:
            self.bound.add(robot)
        return problem

    def _ahead(self, robot: str, region: int, now: Situation) -> bool:
        """Return whether a robot in conflict still has to pass a region."""
        rivals = (other for other in self.plan.robots if now.conflict(robot, other))
        left = (self.plan.robots[other][self.at[other] + 1 :] for other in rivals)
        return any(region == place for places in left for place, _ in places)

    def _too_early(self, robot: str, index: int) -> str:
        for first, i, then, j in self.plan.orders:
            if (then, j) == (robot, index) and self.at[first] < i:
                return f"{robot} does not wait until {first} has reached its place {i}"
        return ""


def _path_problems(robot: str, places: tuple[Line, ...], now: Situation) -> Iterator[str]:
    here = (now.region[robot], now.heading[robot])
    if not places:
        yield f"the plan has no place for {robot}"
        return
    toward, mobility = now.toward[robot], now.header.robots[robot].mobility
    begins = places[0][0]
    if begins != here[0] and begins != toward:
        yield f"the plan begins with {robot} at {now.show(begins)}, but it is elsewhere"
    elif toward is None and now.has_heading(robot) and places[0][1] != here[1]:
        yield f"the plan begins with {robot} facing {places[0][1]}, but it faces {here[1]}"
    for (origin, faced), (to, heading) in pairwise(places):
        if (to, heading) not in now.grid.steps(mobility, (origin, faced)):
            ends = f"{now.show(origin)}, facing {faced}, to {now.show(to)}, facing {heading}"
            yield f"{robot} cannot step from {ends}"
        if to == toward and origin == here[0]:
            continue  # it already takes this step
        for name in (o.name for o in now.obstacles.values() if o.region == to):
            closed = now.status[name].stays
            known = closed or (name in now.discovered and now.status[name] is not Status.RESOLVED)
            if known and robot in now.blocked_by(name):
                yield f"{robot} would enter {now.show(to)} with {name}, which is known"


def _meetings(plan: Line, now: Situation) -> Iterator[Message]:
    """Yield the pairs of robots in conflict that the orders let into a region together."""
    order = Precedence({name: len(places) for name, places in plan.robots.items()}, plan.orders)
    if order.has_circle:
        yield None, "the orders of the plan wait for each other in a circle"
        return
    visits: dict[int, list[tuple[str, int]]] = {}
    for robot, places in plan.robots.items():
        for index, (region, _) in enumerate(places):
            visits.setdefault(region, []).append((robot, index))
    for zone in now.header.never_together or ():
        inside = [v for r in zone.regions for v in visits.get(r, ()) if v[0] in zone.robots]
        for one, other in order.together(inside):
            yield one, f"the plan lets {one} and {other} be together in {zone.regions}"
    for region, ones in visits.items():
        for other, one in order.together(ones):
            if now.conflict(one, other):
                where = f"into {now.show(region)} simultaneously"
                yield one, f"the plan lets {one} and {other} {where}"
        for outsider in (name for name in now.header.robots if name not in plan.robots):
            toward = now.toward[outsider]  # a robot on its way leaves its region in time
            taken = now.taken_by(outsider) if toward is None else {toward}
            for robot, _ in ones if region in taken else ():
                if now.conflict(robot, outsider):
                    yield robot, f"{robot} would enter {now.show(region)}, where {outsider} is"


Event = tuple[str, int, bool]
"""A robot departs for a place of its plan, or (True) arrives there."""


class Precedence:
    """The order of the events of a plan. A robot departs for its places and arrives there in turn;
    ``(first, i, then, j)``: ``then`` departs for its place ``j`` when ``first`` has arrived at its
    place ``i``."""

    def __init__(
        self, lengths: Mapping[str, int], orders: Iterable[tuple[str, int, str, int]]
    ) -> None:
        self._lengths = lengths
        after: dict[Event, list[Event]] = {}
        for robot, length in lengths.items():
            for place in range(length):
                after[robot, place, False] = [(robot, place, True)]
                after[robot, place, True] = [(robot, place + 1, False)][: length - 1 - place]
        for first, i, then, j in orders:
            after[first, i, True].append((then, j, False))
        self._bits = {event: 1 << number for number, event in enumerate(after)}
        self._later = dict.fromkeys(after, 0)  # as bits, all events that come after each
        self.has_circle = False
        try:
            for event in TopologicalSorter(after).static_order():  # the last first
                for other in after[event]:
                    self._later[event] |= self._later[other] | self._bits[other]
        except CycleError:
            self.has_circle = True

    def together(self, visits: Iterable[tuple[str, int]]) -> Iterator[tuple[str, str]]:
        """Yield the robots of two visits of which neither certainly ends before the other."""
        for (one, i), (other, j) in combinations(visits, 2):
            apart = self._left_before(one, i, other, j) or self._left_before(other, j, one, i)
            if one != other and not apart:
                yield one, other

    def _left_before(self, one: str, i: int, other: str, j: int) -> bool:
        """Return whether ``one`` has certainly left its place ``i`` (arrived at the next) when
        ``other`` departs for its place ``j``."""
        if i + 1 >= self._lengths[one] or j == 0:
            return False
        return bool(self._later[one, i + 1, True] & self._bits[other, j, False])
