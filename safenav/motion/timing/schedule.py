"""Times for the dependency graph: everything as early as its edges allow, and why not earlier.

A robot occupies the region that it leaves and the one that it enters from the start to the end
of a move; it starts once every node that its step comes after has ended.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass

from safenav.motion.file.records import Action, Link, Wait
from safenav.motion.mover import Crossing, Mover
from safenav.motion.timing.order import After, DecisionNode, LinkCause, Node, StepNode
from safenav.pace.robot import AT_ONCE

ACTION_SECONDS = "action_seconds"


@dataclass(frozen=True)
class TimedNode:
    """A node in time. ``edge`` is the last that it waited for; ``begun``: when its robots had come
    to rest for it; ``free``: since when each of them had nothing else to do."""

    node: Node
    start: float
    begun: float
    end: float
    edge: After | None
    free: Mapping[str, float]


def scheduled(nodes: Iterable[Node], movers: Mapping[str, Mover]) -> tuple[TimedNode, ...]:
    """Times of the nodes for robots that move so, whose time is 0; the movers stay as they are."""
    done: list[TimedNode] = []
    ahead = {name: copy(mover) for name, mover in movers.items()}
    free = dict.fromkeys(movers, 0.0)
    for node in nodes:
        ready, edge = _latest(done, node.after)
        team = team_of(node)
        start = end = max([ready, *(free[name] for name in team)])
        for name in team:
            if not isinstance(node, StepNode) or start > ahead[name].time + AT_ONCE:
                _rest(ahead[name], start)
        begun = max([start, *(ahead[name].time for name in team)])
        if isinstance(node, StepNode):
            moved = ahead[node.robot]
            moved.move(Crossing(node.tick, node.origin, node.to, node.heading, None, node.short))
            end = moved.time
        elif not isinstance(node, DecisionNode):
            end = _acted([ahead[name] for name in team], node.region)
        done.append(TimedNode(node, start, begun, end, edge, {name: free[name] for name in team}))
        free.update(dict.fromkeys(team, end))
    return tuple(done)


def _acted(team: Sequence[Mover], region: int) -> float:
    for moved in team:
        moved.face(0, region)
    lasting = max(float(moved.values.get(ACTION_SECONDS, 2.0)) for moved in team)
    end = max(moved.time for moved in team) + lasting
    for moved in team:
        moved.rest(0, end)
        moved.resume(0)
    return end


def _rest(moved: Mover, until: float) -> None:
    moved.halt(0)
    if moved.time < until:
        moved.rest(0, until)


def team_of(node: Node) -> tuple[str, ...]:
    """The robots that a node keeps busy."""
    if isinstance(node, DecisionNode):
        return ()
    return (node.robot,) if isinstance(node, StepNode) else (node.robot, *node.others)


def _latest(done: Sequence[TimedNode], edges: Sequence[After]) -> tuple[float, After | None]:
    """The edge whose node ends last, and when; the robot's own of those that end together."""
    last = max((done[edge.node].end for edge in edges), default=0.0)
    near = [edge for edge in edges if done[edge.node].end >= last - AT_ONCE]
    return last, max(near, key=lambda edge: edge.cause is LinkCause.OWN, default=None)


def steps_of(done: Iterable[TimedNode]) -> dict[tuple[str, int], tuple[float, float]]:
    """When each step begins and ends, by robot and tick."""
    steps = ((timed.node, timed) for timed in done if isinstance(timed.node, StepNode))
    return {(node.robot, node.tick): (timed.begun, timed.end) for node, timed in steps}


def actions_of(done: Iterable[TimedNode]) -> Iterator[Action]:
    """The actions, each from when its robots come to rest for it."""
    for timed in done:
        node = timed.node
        if not isinstance(node, StepNode | DecisionNode):
            for name in team_of(node):
                what = (node.tick, node.action, node.obstacle, node.region)
                yield Action(name, *what, timed.start, timed.end)


def waits_of(done: Sequence[TimedNode]) -> Iterator[Wait]:
    """Who waits for whom."""
    for timed in done:
        for name, since in timed.free.items():
            if timed.edge is not None and timed.start > since + AT_ONCE:
                on = done[timed.edge.node].node
                times = (since, timed.start, timed.edge.cause)
                yield Wait(name, timed.node.tick, *times, on.robot, on.tick)


def chain_of(done: Sequence[TimedNode], makespan: float) -> tuple[Link, ...]:
    """The links from the start to the end, each beginning when the one before ends."""
    found: list[Link] = []
    own = LinkCause.OWN
    timed = max((t for t in done if t.free), key=lambda t: t.end, default=None)
    if timed is not None and timed.end < makespan:
        found.append(Link(timed.node.robot, timed.node.tick, "stop", timed.end, makespan, own))
    while timed is not None:
        node, edge = timed.node, timed.edge
        if not isinstance(node, DecisionNode):
            if isinstance(node, StepNode):
                what = f"{node.origin} -> {node.to}"
            else:
                what = f"{node.action} {node.obstacle}"
            cause = own if edge is None else edge.cause
            found.append(Link(node.robot, node.tick, what, timed.start, timed.end, cause))
        timed = None if edge is None else done[edge.node]
    return tuple(reversed(found))
