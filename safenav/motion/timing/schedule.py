"""Times for the dependency graph: everything as early as its edges allow, and why not earlier.

A robot occupies the region that it leaves and the one that it enters from the start to the end
of a move; it starts once every node that its step comes after has ended. Whoever is in motion
when its turn has not come yet halts first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from safenav.motion.file.records import (
    Action,
    Line,
    Link,
    Outcome,
    Release,
    Reserve,
    Wait,
)
from safenav.motion.mover import Errand, Mover
from safenav.motion.timing.order import After, Cause, Deed, Node, Step

ACTION_SECONDS = "action_seconds"
AT_ONCE = 1e-9
"""Seconds that are no delay: sums of the same durations in another order."""


@dataclass(frozen=True)
class Schedule:
    """What everybody does when, in the order of time, and how long it takes."""

    lines: tuple[Line, ...]
    outcome: Outcome


@dataclass(frozen=True)
class _Done:
    """A node in time. ``begin`` is when its robot was ready to halt for it, or to begin;
    ``edge`` is what it waited for last."""

    node: Node
    begin: float
    halted: float
    start: float
    end: float
    edge: After | None


def scheduled(nodes: Iterable[Node], movers: Mapping[str, Mover]) -> Schedule:
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
        mover = self._movers[node.robot]
        begin = mover.time
        edge = self._latest(node.after)
        ready = 0.0 if edge is None else self._done[edge.node].end
        late = ready > begin + AT_ONCE
        halted = begin
        if late or isinstance(node, Deed):
            self._lines += mover.halt(node.tick)
            halted = mover.time
        if late:
            if mover.time < ready:
                self._lines += mover.rest(node.tick, ready)
            assert edge is not None
            on = self._done[edge.node].node
            wait = Wait(node.robot, node.tick, begin, mover.time, edge.cause, on.robot, on.tick)
            self._lines.append(wait)
            self._waited[node.robot] += mover.time - begin
        start = mover.time
        if isinstance(node, Step):
            self._step(node, mover)
        else:
            self._deed(node, mover)
        bound = edge if late and halted <= ready else self._own(node.after)
        self._done.append(_Done(node, begin, halted, start, mover.time, bound))

    def _step(self, step: Step, mover: Mover) -> None:
        errand = Errand(step.tick, step.origin, step.to, step.heading, step.then, step.short)
        self._lines.append(Reserve(step.robot, step.tick, step.to, mover.time))
        self._lines += mover.move(errand)
        self._lines.append(Release(step.robot, step.tick, step.origin, mover.time))

    def _deed(self, deed: Deed, mover: Mover) -> None:
        self._lines += mover.face(deed.tick, deed.region)
        begin = mover.time
        end = begin + float(mover.values.get(ACTION_SECONDS, 2.0))
        self._lines += mover.rest(deed.tick, end)
        action = Action(
            deed.robot, deed.tick, deed.action, deed.obstacle, deed.region, begin, mover.time
        )
        self._lines.append(action)
        self._lines += mover.resume(deed.tick)

    def _latest(self, edges: tuple[After, ...]) -> After | None:
        """The edge whose node ends last; the robot's own of those that end at once."""
        return max(
            edges,
            key=lambda edge: (self._done[edge.node].end, edge.cause is Cause.OWN),
            default=None,
        )

    @staticmethod
    def _own(edges: tuple[After, ...]) -> After | None:
        return next((edge for edge in edges if edge.cause is Cause.OWN), None)

    def schedule(self) -> Schedule:
        last: dict[str, _Done] = {done.node.robot: done for done in self._done}
        tick = max((done.node.tick for done in self._done), default=0)
        busy = {}
        for name, mover in self._movers.items():
            self._lines += mover.halt(tick)
            busy[name] = mover.time - self._waited[name]
        makespan = max((mover.time for mover in self._movers.values()), default=0.0)
        latest = max(self._movers.values(), key=lambda mover: mover.time, default=None)
        chain = () if latest is None else self._chain(last.get(latest.robot), makespan)
        for mover in self._movers.values():
            if mover.time < makespan:
                self._lines += mover.rest(tick, makespan)
        lines = sorted(self._lines, key=_when)
        return Schedule(tuple(lines), Outcome(makespan, busy, dict(self._waited), chain))

    def _chain(self, done: _Done | None, makespan: float) -> tuple[Link, ...]:
        """The links from the start to the end, each beginning when the one before ends."""
        found: list[Link] = []
        if done is not None and done.end < makespan:
            robot, tick = done.node.robot, done.node.tick
            found.append(Link(robot, tick, "stop", done.end, makespan, Cause.OWN))
        while done is not None:
            node, edge = done.node, done.edge
            cause = edge.cause if edge is not None else Cause.OWN
            found.append(Link(node.robot, node.tick, _what(node), done.start, done.end, cause))
            if (edge is None or edge.cause is Cause.OWN) and done.begin < done.start:
                stop = Link(node.robot, node.tick, "stop", done.begin, done.start, Cause.OWN)
                found.append(stop)
            done = self._done[edge.node] if edge is not None else None
        return tuple(reversed(found))


def _what(node: Node) -> str:
    if isinstance(node, Step):
        return f"{node.origin} -> {node.to}"
    return f"{node.action} {node.obstacle}"


def _when(line: Line) -> tuple[float, int]:
    """By time; at the same time what ends comes before what begins."""
    if isinstance(line, Release):
        return line.t, 0
    time = line.t0 if hasattr(line, "t0") else line.t
    return time, 1 if isinstance(line, Reserve) else 2
