"""The dependency graph of a run, from its trace.

The turns of a trace are in a serial order in which nobody ever enters a region where another
robot is. In continuous time robots move simultaneously, each at its own pace; only the
dependencies of the serial order are kept, as edges from earlier to later turns (so there is no
circle, and no deadlock for any durations). Sources: Hoenig et al. (RA-L 2019), the action
dependency graph; section VII of the paper names the problem.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from heapq import heappop, heappush

from safenav.motion.geometry import MetricFloor
from safenav.trace.records import (
    Blocked,
    Met,
    Move,
    Plan,
    PlanEnd,
    Pop,
    Push,
    Request,
    Resolved,
    Synthesis,
    Told,
)
from safenav.trace.setting import ObstacleHeader, RobotHeader
from safenav.trace.trace import Trace

SHARED = (Request, Push, Pop, Told, Blocked, Plan, PlanEnd, Synthesis)
"""Lines of decisions that concern more than one robot."""


class LinkCause(StrEnum):
    """Why a step or an action comes after another."""

    OWN = "own"
    """The robot itself did that before."""
    REGION = "region"
    """The other robot left the region that this one enters."""
    OBSTACLE = "obstacle"
    """It resolved an obstacle that was in the way."""
    SYNTHESIS = "synthesis"
    """An event of that moment caused the robot's present strategy."""
    TOGETHER = "together"
    """The action takes several robots."""


@dataclass(frozen=True)
class After:
    """An edge: not before the node with this index has ended."""

    node: int
    cause: LinkCause


@dataclass(frozen=True)
class StepNode:
    """A move between regions. ``short``: the robot resolves an obstacle that stands in ``to``;
    ``then``: the heading of its next step, None if it has no more."""

    index: int
    tick: int
    robot: str
    after: tuple[After, ...]
    origin: int
    to: int
    heading: str
    short: bool = False
    then: str | None = None


@dataclass(frozen=True)
class Deed:
    """A robot at ``at`` acts on an obstacle in ``region``; ``others`` take part."""

    index: int
    tick: int
    robot: str
    after: tuple[After, ...]
    action: str
    obstacle: str
    at: int
    region: int
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class DecisionNode:
    """Shared decisions (requests, objectives, plans, strategies) in the turn of a robot; they take
    no time, and come in the order of the trace."""

    index: int
    tick: int
    robot: str
    after: tuple[After, ...]


Node = StepNode | Deed | DecisionNode


def order_of(trace: Trace, floor: MetricFloor) -> tuple[Node, ...]:
    """The nodes of a run in an order in which all edges point backwards."""
    order = _Order(trace.header.scenario.robots, trace.obstacles, floor, _arrivals(trace))
    for number, record in enumerate(trace.records):
        order.take(number, record)
    return _with_next_headings(_sorted(order.nodes))


@dataclass(frozen=True)
class _Arrivals:
    """Steps that take several ticks: the record with which each begins, the record with which
    it ends, and all records in between."""

    begins: dict[int, int]
    ends: dict[int, int]
    between: frozenset[int]


def _arrivals(trace: Trace) -> _Arrivals:
    begins: dict[int, int] = {}
    pending: dict[str, list[int]] = {}
    skipped: set[int] = set()
    for number, record in enumerate(trace.records):
        if not isinstance(record, Move):
            continue
        if record.toward is not None:
            pending.setdefault(record.robot, []).append(number)
            continue
        lines = pending.pop(record.robot, [])
        skipped.update(lines[1:])
        if lines and record.to != record.from_:
            begins[lines[0]] = number
        else:
            skipped.update(lines)  # it gave up, and never left
    for lines in pending.values():
        skipped.update(lines)  # the trace ends before it arrives
    return _Arrivals(begins, {end: start for start, end in begins.items()}, frozenset(skipped))


@dataclass(frozen=True)
class _Transit:
    """A step of several ticks that has begun, and what the robot did before it."""

    step: int
    before: int | None


@dataclass
class _Order:
    """Goes through a trace; owns the state of the run so far."""

    robots: Mapping[str, RobotHeader]
    obstacles: Mapping[str, ObstacleHeader]
    floor: MetricFloor
    arrivals: _Arrivals
    nodes: list[Node] = field(default_factory=list)
    last: dict[str, int] = field(default_factory=dict)
    """The newest node of each robot."""
    left: dict[int, dict[str, int]] = field(default_factory=lambda: defaultdict(dict))
    """The step with which each robot left a region last."""
    cause: dict[str, int] = field(default_factory=dict)
    """The decision that each robot follows."""
    decided: int | None = None
    """The newest decision, ``deciding`` if more may join it."""
    deciding: bool = False
    planned: tuple[str, ...] = ()
    """The robots of the joint plan."""
    resolved: dict[int, list[tuple[frozenset[str], int]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    """Actions that opened a region, where an obstacle was, to those whom it blocked."""
    last_met: dict[str, int] = field(default_factory=dict)
    """Actions that fulfilled the last need of an obstacle, which is about to be resolved."""
    turn: str | None = None
    transit: dict[str, _Transit] = field(default_factory=dict)
    at: dict[str, int] = field(default_factory=dict)
    """Where each robot is, by the trace: in its old region until it arrives."""

    def take(self, number: int, record: object) -> None:
        if isinstance(record, Move):
            self._move(number, record)
        elif isinstance(record, Met):
            self._met(record)
        elif isinstance(record, Resolved):
            self._resolved(record)
        elif isinstance(record, SHARED) and self.turn is not None:
            decision = self._decision(self.turn, record.tick)
            if isinstance(record, Plan):
                self.planned = tuple(record.robots)
            if isinstance(record, Synthesis):
                self.cause[record.robot] = decision
            elif isinstance(record, Plan | PlanEnd):
                self.cause.update(dict.fromkeys(self.planned, decision))

    def _decision(self, robot: str, tick: int) -> int:
        if self.decided is not None and self.deciding:
            return self.decided
        transit = self.transit.get(robot)
        event = self.last.get(robot) if transit is None else transit.before
        after = [] if event is None else [After(event, LinkCause.OWN)]
        node = DecisionNode(len(self.nodes), tick, robot, (*after, *self._in_turn()))
        self.nodes.append(node)
        self.decided, self.deciding = node.index, True
        return node.index

    def _in_turn(self) -> tuple[After, ...]:
        return () if self.decided is None else (After(self.decided, LinkCause.SYNTHESIS),)

    def _move(self, number: int, move: Move) -> None:
        self.turn, self.deciding = move.robot, False
        self.at[move.robot] = move.to
        if number in self.arrivals.between:
            return
        if number in self.arrivals.ends:
            self.left[move.from_][move.robot] = self.transit.pop(move.robot).step
            return
        end = self.arrivals.begins.get(number)
        target = move.to if end is None else move.toward
        assert target is not None
        if target == move.from_:
            return
        heading = self.floor.heading(move.from_, target)
        step = StepNode(len(self.nodes), move.tick, move.robot, (), move.from_, target, heading)
        before = self.last.get(move.robot)
        self._add(replace(step, after=self._before(move.robot, target)))
        if end is None:
            self.left[move.from_][move.robot] = step.index
        else:
            self.transit[move.robot] = _Transit(step.index, before)

    def _before(self, robot: str, target: int) -> tuple[After, ...]:
        found = self._own(robot)
        for other, node in self.left[target].items():
            if self._conflict(robot, other):
                found.append(After(node, LinkCause.REGION))
        for blocked, node in self.resolved[target]:
            if robot in blocked:
                found.append(After(node, LinkCause.OBSTACLE))
        return tuple(found)

    def _own(self, robot: str) -> list[After]:
        found = []
        if robot in self.last:
            found.append(After(self.last[robot], LinkCause.OWN))
        if robot in self.cause:
            found.append(After(self.cause[robot], LinkCause.SYNTHESIS))
        return found

    def _met(self, record: Met) -> None:
        """The action that fulfils one of several needs. Robots that resolve the rest by entering
        are let in."""
        obstacle = self.obstacles[record.obstacle]
        deed = self._act(record, record.need)
        if record.need == len(obstacle.all_needs) - 1:
            self.last_met[record.obstacle] = deed
            return
        let_in = frozenset(
            name
            for name in obstacle.blocks & self.robots.keys()
            if obstacle.resolved_by_entering(self.robots[name], record.need + 1)
        )
        self.resolved[obstacle.region].append((let_in, deed))

    def _resolved(self, record: Resolved) -> None:
        """An obstacle is resolved, by the action of its last need, or, where no line records it,
        by this one."""
        obstacle = self.obstacles[record.obstacle]
        deed = self.last_met.pop(record.obstacle, None)
        if deed is None:
            deed = self._act(record, len(obstacle.all_needs) - 1)
        if record.traversable is not False:
            self.resolved[obstacle.region].append((obstacle.blocks, deed))

    def _act(self, record: Met | Resolved, number: int) -> int:
        """The action that fulfils the need of that number; its node."""
        obstacle = self.obstacles[record.obstacle]
        need = obstacle.all_needs[number]
        others = tuple(
            name
            for name in record.robots or ()
            if name != record.robot
            and (need.together or isinstance(record, Resolved))
            and self.at.get(name, self.robots[name].start) in need.regions
            and need.action in self.robots[name].capabilities
        )
        team = (record.robot, *others)
        mine = self._until_now(record.robot)
        together = [
            After(edge.node, LinkCause.TOGETHER) for o in others for edge in self._until_now(o)
        ]
        deed = Deed(
            len(self.nodes),
            record.tick,
            record.robot,
            (*mine, *together, *self._in_turn()),
            need.action,
            record.obstacle,
            record.at,
            obstacle.region,
            others,
        )
        self.nodes.append(deed)
        self.deciding = False
        for name in team:
            if name in self.transit:
                self._first(name, deed.index)
            else:
                self._stop_short(name, obstacle.region)
                self.last[name] = deed.index
        return deed.index

    def _until_now(self, robot: str) -> list[After]:
        """The last step of a robot before it acts: not the step that it has begun, if it acts in
        the region that it has not left yet."""
        transit = self.transit.get(robot)
        if transit is None:
            return self._own(robot)
        known = (LinkCause.OWN, LinkCause.SYNTHESIS)
        return [edge for edge in self.nodes[transit.step].after if edge.cause in known]

    def _first(self, robot: str, deed: int) -> None:
        """The step that a robot has begun comes after this action."""
        step = self.nodes[self.transit[robot].step]
        others = (edge for edge in step.after if edge.cause is not LinkCause.OWN)
        after = (After(deed, LinkCause.OWN), *others)
        self.nodes[step.index] = replace(step, after=after)
        self.transit[robot] = _Transit(step.index, deed)

    def _stop_short(self, robot: str, region: int) -> None:
        """The step into an obstacle's own region ends before it, if the robot acts there."""
        if robot in self.last:
            step = self.nodes[self.last[robot]]
            if isinstance(step, StepNode) and step.to == region:
                self.nodes[step.index] = replace(step, short=True)

    def _add(self, node: Node) -> None:
        self.nodes.append(node)
        self.last[node.robot] = node.index

    def _conflict(self, robot: str, other: str) -> bool:
        if robot == other:
            return False
        mine, theirs = self.robots[robot], self.robots[other]
        if mine.conflicts is None or theirs.conflicts is None:
            return mine.layer == theirs.layer
        return other in mine.conflicts or robot in theirs.conflicts


def _sorted(nodes: list[Node]) -> list[Node]:
    """The nodes renumbered so that all edges point backwards, otherwise as they were."""
    missing = {node.index: len({edge.node for edge in node.after}) for node in nodes}
    following = defaultdict(set)
    for node in nodes:
        for edge in node.after:
            following[edge.node].add(node.index)
    ready = [index for index, count in missing.items() if not count]
    place: dict[int, int] = {}
    while ready:
        index = heappop(ready)
        place[index] = len(place)
        for other in following[index]:
            missing[other] -= 1
            if not missing[other]:
                heappush(ready, other)
    assert len(place) == len(nodes), "the edges of a run have no circle"
    return [
        replace(
            nodes[index],
            index=number,
            after=tuple(replace(edge, node=place[edge.node]) for edge in nodes[index].after),
        )
        for index, number in place.items()
    ]


def _with_next_headings(nodes: Iterable[Node]) -> tuple[Node, ...]:
    following: dict[str, str] = {}
    found: list[Node] = []
    for node in reversed(list(nodes)):
        if isinstance(node, StepNode):
            found.append(replace(node, then=following.get(node.robot)))
            following[node.robot] = node.heading
        else:
            found.append(node)
    return tuple(reversed(found))
