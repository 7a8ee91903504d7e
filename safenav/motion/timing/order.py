"""What has to wait for what: the dependency graph of a run, from its trace.

The turns of a trace are in a serial order in which nobody ever enters a region where another
robot is. In continuous time robots move at once, each at its own pace; of the serial order only
what matters is kept, as edges from earlier to later turns (so there is no circle, and no
deadlock for any durations). Sources: Hoenig et al. (RA-L 2019), the action dependency graph;
section VII of the paper names the problem.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from safenav.motion.geometry import Floor
from safenav.trace.records import (
    Move,
    Resolved,
    Synthesis,
    Trace,
)
from safenav.trace.setting import ObstacleHeader, RobotHeader


class Cause(StrEnum):
    """Why a step or a deed comes after another."""

    OWN = "own"
    """The robot itself did that before."""
    REGION = "region"
    """The other robot left the region that this one enters."""
    OBSTACLE = "obstacle"
    """It resolved an obstacle that was in the way."""
    SYNTHESIS = "synthesis"
    """What happened then made the robot's present strategy."""
    TOGETHER = "together"
    """The action takes several robots."""


@dataclass(frozen=True)
class After:
    """An edge: not before the node with this index has ended."""

    node: int
    cause: Cause


@dataclass(frozen=True)
class Step:
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


Node = Step | Deed


def order_of(trace: Trace, floor: Floor) -> tuple[Node, ...]:
    """The nodes of a run in an order in which all edges point backwards."""
    order = _Order(trace.header.scenario.robots, trace.obstacles, floor, _arrivals(trace))
    for number, record in enumerate(trace.records):
        order.take(number, record)
    return _with_next_headings(order.nodes)


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


@dataclass
class _Order:
    """Goes through a trace; owns what is known of the run so far."""

    robots: Mapping[str, RobotHeader]
    obstacles: Mapping[str, ObstacleHeader]
    floor: Floor
    arrivals: _Arrivals
    nodes: list[Node] = field(default_factory=list)
    last: dict[str, int] = field(default_factory=dict)
    """The newest node of each robot."""
    left: dict[int, dict[str, int]] = field(default_factory=lambda: defaultdict(dict))
    """The step with which each robot left a region last."""
    cause: dict[str, int] = field(default_factory=dict)
    """The node whose end made each robot's strategy."""
    resolved: dict[int, list[tuple[frozenset[str], int]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    """Deeds that resolved an obstacle of a region, and whom it blocked."""
    turn: str | None = None
    started: dict[int, int] = field(default_factory=dict)
    """The step of each record that begins one."""

    def take(self, number: int, record: object) -> None:
        if isinstance(record, Move):
            self._move(number, record)
        elif isinstance(record, Resolved):
            self._resolved(record)
        elif isinstance(record, Synthesis) and self.turn in self.last:
            self.cause[record.robot] = self.last[self.turn]

    def _move(self, number: int, move: Move) -> None:
        self.turn = move.robot
        if number in self.arrivals.between:
            return
        start = self.arrivals.ends.get(number)
        if start is not None:
            self.left[move.from_][move.robot] = self.started[start]
            return
        end = self.arrivals.begins.get(number)
        target = move.to if end is None else move.toward
        assert target is not None
        if target == move.from_:
            return
        heading = self.floor.heading(move.from_, target)
        step = Step(len(self.nodes), move.tick, move.robot, (), move.from_, target, heading)
        self._add(replace(step, after=self._before(move.robot, target)))
        if end is None:
            self.left[move.from_][move.robot] = step.index
        else:
            self.started[number] = step.index

    def _before(self, robot: str, target: int) -> tuple[After, ...]:
        found = self._own(robot)
        for other, node in self.left[target].items():
            if self._conflict(robot, other):
                found.append(After(node, Cause.REGION))
        for blocked, node in self.resolved[target]:
            if robot in blocked:
                found.append(After(node, Cause.OBSTACLE))
        return tuple(found)

    def _own(self, robot: str) -> list[After]:
        found = []
        if robot in self.last:
            found.append(After(self.last[robot], Cause.OWN))
        if robot in self.cause:
            found.append(After(self.cause[robot], Cause.SYNTHESIS))
        return found

    def _resolved(self, record: Resolved) -> None:
        obstacle = self.obstacles[record.obstacle]
        need = record.need or 0
        others = tuple(name for name in record.robots or () if name != record.robot)
        together = [
            After(edge.node, Cause.TOGETHER) for other in others for edge in self._own(other)
        ]
        deed = Deed(
            len(self.nodes),
            record.tick,
            record.robot,
            (*self._own(record.robot), *together),
            obstacle.all_needs[need].action,
            record.obstacle,
            record.at,
            obstacle.region,
            others,
        )
        for name in (record.robot, *others):
            self._stop_short(name, obstacle.region)
        self._add(deed)
        for other in others:
            self.last[other] = deed.index
        if need == len(obstacle.all_needs) - 1 and record.traversable is not False:
            self.resolved[obstacle.region].append((obstacle.blocks, deed.index))

    def _stop_short(self, robot: str, region: int) -> None:
        """The step into an obstacle's own region ends before it, if the robot acts there."""
        if robot in self.last:
            step = self.nodes[self.last[robot]]
            if isinstance(step, Step) and step.to == region:
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


def _with_next_headings(nodes: Iterable[Node]) -> tuple[Node, ...]:
    following: dict[str, str] = {}
    found: list[Node] = []
    for node in reversed(list(nodes)):
        if isinstance(node, Step):
            found.append(replace(node, then=following.get(node.robot)))
            following[node.robot] = node.heading
        else:
            found.append(node)
    return tuple(reversed(found))
