"""Times for the dependency graph: everything as early as its edges allow, and why not earlier.

A robot occupies the region that it leaves and the one that it enters from the start to the end
of a move; it starts once every node that its step comes after has ended. A robot in motion whose
turn has not come yet halts first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from safenav.motion.file.records import (
    Action,
    Line,
    Link,
    MotionOutcome,
    Release,
    Reserve,
    Wait,
)
from safenav.motion.mover import Crossing, Mover
from safenav.motion.timing.order import After, DecisionNode, Deed, LinkCause, Node, StepNode

ACTION_SECONDS = "action_seconds"

STANDING = 1.0
"""Seconds that a motion shows of a run in which nobody moves."""
AT_ONCE = 1e-9
"""Seconds that are not a delay: sums of the same durations in another order."""


@dataclass(frozen=True)
class Timetable:
    """The activities of all robots in the order of time, with their durations."""

    lines: tuple[Line, ...]
    outcome: MotionOutcome


@dataclass(frozen=True)
class _Stop:
    """A robot that halted from ``begin`` until a node could start."""

    robot: str
    begin: float


@dataclass(frozen=True)
class _Done:
    """A node in time. ``edge`` is what it waited for last; ``stop`` is the halt between that and
    its start, if there was one."""

    node: Node
    start: float
    end: float
    edge: After | None
    stop: _Stop | None


def scheduled(nodes: Iterable[Node], movers: Mapping[str, Mover]) -> Timetable:
    """Carries out the nodes with these movers, whose time is 0. Every robot ends at rest."""
    clock = _Clock(movers)
    for node in nodes:
        clock.take(node)
    return clock.schedule()


class _Clock:
    def __init__(self, movers: Mapping[str, Mover]) -> None:
        self._movers = movers
        self._lines: list[Line] = [
            Reserve(name, 0, mover.region, 0.0) for name, mover in movers.items()
        ]
        self._done: list[_Done] = []
        self._waited = dict.fromkeys(movers, 0.0)

    def take(self, node: Node) -> None:
        ready, edge = self._latest(node.after)
        if isinstance(node, DecisionNode):
            self._done.append(_Done(node, ready, ready, edge, None))
            return
        names = [node.robot, *(node.others if isinstance(node, Deed) else ())]
        begins = {name: self._movers[name].time for name in names}
        acting = isinstance(node, Deed)
        for name in names:
            if acting or ready > begins[name] + AT_ONCE:
                self._lines += self._movers[name].halt(node.tick)
        start = max(ready, *(self._movers[name].time for name in names))
        if not acting and ready <= begins[node.robot] + AT_ONCE:
            start = begins[node.robot]  # it continues without a halt
        stop = None
        for name in names:
            mover = self._movers[name]
            if mover.time >= start and mover.time > max(begins[name], ready) + AT_ONCE:
                stop = _Stop(name, begins[name])
            if mover.time < start:
                self._lines += mover.rest(node.tick, start)
            if edge is not None and ready > begins[name] + AT_ONCE:
                self._wait(name, node, begins[name], start, edge)
        if stop is not None:
            edge = self._own(stop.robot, node.after)
        if isinstance(node, StepNode):
            self._step(node, self._movers[node.robot])
        else:
            self._deed(node, [self._movers[name] for name in names])
        end = max(self._movers[name].time for name in names)
        self._done.append(_Done(node, start, end, edge, stop))

    def _wait(self, name: str, node: Node, begin: float, start: float, edge: After) -> None:
        on = self._done[edge.node].node
        self._lines.append(Wait(name, node.tick, begin, start, edge.cause, on.robot, on.tick))
        self._waited[name] += start - begin

    def _step(self, step: StepNode, mover: Mover) -> None:
        crossing = Crossing(step.tick, step.origin, step.to, step.heading, step.then, step.short)
        self._lines.append(Reserve(step.robot, step.tick, step.to, mover.time))
        self._lines += mover.move(crossing)
        self._lines.append(Release(step.robot, step.tick, step.origin, mover.time))

    def _deed(self, deed: Deed, movers: list[Mover]) -> None:
        for mover in movers:
            self._lines += mover.face(deed.tick, deed.region)
        begin = max(mover.time for mover in movers)
        end = begin + max(float(mover.values.get(ACTION_SECONDS, 2.0)) for mover in movers)
        for mover in movers:
            self._lines += mover.rest(deed.tick, end)
            self._lines.append(
                Action(mover.robot, deed.tick, deed.action, deed.obstacle, deed.region, begin, end)
            )
        for mover in movers:
            self._lines += mover.resume(deed.tick)

    def _latest(self, edges: tuple[After, ...]) -> tuple[float, After | None]:
        """The edge whose node ends last, and when; the robot's own of those that end together."""
        if not edges:
            return 0.0, None
        own = {edge.node: edge.cause is LinkCause.OWN for edge in edges}
        last = max(edges, key=lambda edge: (self._done[edge.node].end, own[edge.node]))
        near = self._done[last.node].end - AT_ONCE
        for edge in edges:
            if edge.cause is LinkCause.OWN and self._done[edge.node].end >= near:
                return self._done[last.node].end, edge
        return self._done[last.node].end, last

    def _own(self, robot: str, edges: tuple[After, ...]) -> After | None:
        """The edge to what this robot did before."""
        for edge in edges:
            done = self._done[edge.node].node
            others = done.others if isinstance(done, Deed) else ()
            if edge.cause in (LinkCause.OWN, LinkCause.TOGETHER) and robot in (done.robot, *others):
                return edge
        return None

    def schedule(self) -> Timetable:
        last: dict[str, _Done] = {}
        for done in self._done:
            if isinstance(done.node, DecisionNode):
                continue
            others = done.node.others if isinstance(done.node, Deed) else ()
            last.update((name, done) for name in (done.node.robot, *others))
        tick = max((done.node.tick for done in self._done), default=0)
        busy = {}
        for name, mover in self._movers.items():
            self._lines += mover.halt(tick)
            busy[name] = mover.time - self._waited[name]
        makespan = max((mover.time for mover in self._movers.values()), default=0.0)
        latest = max(self._movers.values(), key=lambda mover: mover.time, default=None)
        chain = () if latest is None else self._chain(last.get(latest.robot), makespan)
        # Where nobody ever moves, a moment at rest says where everybody stands.
        until = makespan or STANDING
        for mover in self._movers.values():
            if mover.time < until:
                self._lines += mover.rest(tick, until)
        lines = sorted(self._lines, key=when)
        return Timetable(tuple(lines), MotionOutcome(until, busy, dict(self._waited), chain))

    def _chain(self, done: _Done | None, makespan: float) -> tuple[Link, ...]:
        """The links from the start to the end, each beginning when the one before ends."""
        found: list[Link] = []
        if done is not None and done.end < makespan:
            robot, tick = done.node.robot, done.node.tick
            found.append(Link(robot, tick, "stop", done.end, makespan, LinkCause.OWN))
        while done is not None:
            node, edge, stop = done.node, done.edge, done.stop
            cause = edge.cause if edge is not None else LinkCause.OWN
            if not isinstance(node, DecisionNode):
                what = _what(node)
                found.append(Link(node.robot, node.tick, what, done.start, done.end, cause))
            if stop is not None:
                found.append(
                    Link(stop.robot, node.tick, "stop", stop.begin, done.start, LinkCause.OWN)
                )
            done = self._done[edge.node] if edge is not None else None
        return tuple(reversed(found))


def _what(node: StepNode | Deed) -> str:
    if isinstance(node, StepNode):
        return f"{node.origin} -> {node.to}"
    return f"{node.action} {node.obstacle}"


def when(line: Line) -> tuple[float, int]:
    """By time; at the same time what ends comes before what begins."""
    if isinstance(line, Release):
        return line.t, 0
    time = line.t0 if hasattr(line, "t0") else line.t
    return time, 1 if isinstance(line, Reserve) else 2
