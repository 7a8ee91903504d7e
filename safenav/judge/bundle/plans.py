"""Joint plans: their orders keep rivals apart for any duration of the steps, and steps follow
them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import combinations, pairwise

from safenav.judge.bundle.strategies import RefusedError, require
from safenav.judge.formulas import Pose
from safenav.judge.lines import Line
from safenav.judge.state import State

Order = tuple[str, int, str, int]
"""``first, i, then, j``: ``then`` departs for its place ``j`` when ``first`` is at its ``i``."""


@dataclass
class Plan:
    """A plan in force. ``at``: the number of each robot's place."""

    ways: Mapping[str, tuple[Pose, ...]]
    orders: tuple[Order, ...]
    at: dict[str, int]

    def step(self, robot: str, after: Pose, s: State) -> None:
        """Refuse unless a step to a pose is the next one of a robot, and its orders allow it."""
        require(robot in self.ways, f"{robot} moves by a plan that it is not in")
        index, way = self.at[robot] + 1, self.ways[robot]
        require(index < len(way), f"{robot} has no more places in its plan")
        require(way[index] == after, f"{robot} goes to {after}; its plan says {way[index]}")
        for first, i, then, j in self.orders:
            if (then, j) == (robot, index):
                to = s.robots[first].bound  # after its last place a strategy may drive it
                there = self.at[first] - (to == self.ways[first][self.at[first]][0])
                require(there >= i, f"{robot} does not wait until {first} is at its place {i}")
        self.at[robot] = index


def begin(e: Line, s: State) -> Plan:
    """Return the plan of a line. Refuse unless it begins with the poses of its robots, consists of
    their steps, and its orders keep rivals apart."""
    at = dict.fromkeys(e.robots, 0)
    for robot, way in e.robots.items():
        here, there = s.robots[robot].pose, s.destination(robot)
        require(way[:1] in ((here,), (there,)), f"the plan does not begin where {robot} is")
        at[robot] = int(here != there and way[0] == here)  # it already takes its first step
        require(not at[robot] or there in way[1:2], f"{robot} takes another step than its plan")
        for one, to in pairwise(way):
            legal = to in s.world.steps(s.robots[robot].faces, one)
            require(legal, f"{robot} cannot step from {one} to {to}")
    for first, _, then, j in e.orders:
        exists = first in e.robots and j < len(e.robots.get(then, ()))
        require(exists, f"an order names place {j} of {then}, or {first}, which does not exist")
    plan = Plan(e.robots, e.orders, at)
    for problem in _meetings(plan, s):
        raise RefusedError(problem)
    return plan


def _meetings(plan: Plan, s: State) -> Iterator[str]:
    """Yield the rivals that the orders let into a region together."""
    lengths = {name: len(way) for name, way in plan.ways.items()}
    for first, i, _, _ in plan.orders:  # who waits for a place beyond a way does not go
        lengths[first] = max(lengths[first], i + 1)
    order = Precedence(lengths, plan.orders)
    visits: dict[int, list[tuple[str, int]]] = {}
    for robot, way in plan.ways.items():
        for index, (region, _) in enumerate(way):
            visits.setdefault(region, []).append((robot, index))
    for who, regions in s.zones:
        inside = [each for r in regions for each in visits.get(r, ()) if each[0] in who]
        for one, other in order.together(inside):
            yield f"the plan lets {one} and {other} be together in {sorted(regions)}"
    for region, ones in visits.items():
        for one, other in order.together(ones):
            if other in s.rivals[one]:
                yield f"the plan lets {one} and {other} into {s.show(region)} together"
        for outsider in s.robots.keys() - plan.ways.keys():
            bound = s.robots[outsider].bound  # a robot on its way leaves its region in time
            holds = s.robots[outsider].holds if bound is None else {bound}
            for robot in {name for name, _ in ones} & {*s.rivals[outsider]}:
                if region in holds:
                    yield f"{robot} would enter {s.show(region)}, where {outsider} is"


Event = tuple[str, int, bool]
"""A robot departs for a place of its plan, or (True) is there."""


class Precedence:
    """The order of the events of a plan: each robot departs for its places and arrives there in
    turn, and each order holds."""

    def __init__(self, lengths: Mapping[str, int], orders: Iterable[Order]) -> None:
        self._lengths = lengths
        after: dict[Event, list[Event]] = {}
        for robot, length in lengths.items():
            for place in range(length):
                after[robot, place, False] = [(robot, place, True)]
                after[robot, place, True] = [(robot, place + 1, False)][: length - 1 - place]
        for first, i, then, j in orders:
            after[first, i, True].append((then, j, False))
        bits = {event: 1 << number for number, event in enumerate(after)}
        self._bits, self._later = bits, dict.fromkeys(after, 0)  # all events that come after each
        try:
            for event in TopologicalSorter(after).static_order():  # the last first
                for other in after[event]:
                    self._later[event] |= self._later[other] | bits[other]
        except CycleError:
            raise RefusedError("the orders of the plan wait for each other in a circle") from None

    def together(self, visits: Iterable[tuple[str, int]]) -> Iterator[tuple[str, str]]:
        """Yield the robots of two visits of which neither certainly ends before the other."""
        for (one, i), (other, j) in combinations(visits, 2):
            apart = self._left_before(one, i, other, j) or self._left_before(other, j, one, i)
            if one != other and not apart:
                yield one, other

    def _left_before(self, one: str, i: int, other: str, j: int) -> bool:
        """Return whether ``one`` is certainly one place on when ``other`` departs for ``j``."""
        if i + 1 >= self._lengths[one] or j == 0:
            return False
        return bool(self._later[one, i + 1, True] & self._bits[other, j, False])
