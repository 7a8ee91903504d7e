"""Rounds of at most N ticks, forever, by one robot alone: exact, and without a counter.

K is the greatest set of poses of the last target from which another round of at most N ticks leads
back into K; the robot can meet the deadline forever iff its first round leads into K in time.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping

from msgspec import Struct

from safenav.world.poses import FAR, Mask, PoseGraph, bits

Costs = Mapping[int, int]
"""The steps to each pose."""


class Walk(Struct, frozen=True, eq=False):
    """A robot's rounds: its ``targets`` as pose masks, met in turn, inside ``allowed`` poses;
    ``ticks`` of each step; its start. ``strict``: the other targets are not touched on the way (the
    paper's patrol)."""

    graph: PoseGraph
    targets: tuple[Mask, ...]
    allowed: Mask
    start: int
    ticks: int = 1
    strict: bool = False


def least_within(walk: Walk) -> int | None:
    """Return the least N such that every round can take at most N ticks; None if there is none."""
    costs, begin = _rounds(walk), _leg(walk, {walk.start: 0})
    values = sorted({*begin.values(), *(c for row in costs.values() for c in row.values())})
    least = bisect_left(values, True, key=lambda most: bool(_kept(costs, begin, most)))
    return values[least] if least < len(values) else None


def _kept(costs: Mapping[int, Costs], begin: Costs, most: int) -> set[int]:
    """Return K if the first round leads into it in time, else the empty set."""
    lasting = set(costs)
    while True:
        after = {p for p in lasting if any(c <= most and q in lasting for q, c in costs[p].items())}
        if after == lasting:
            break
        lasting = after
    return lasting if any(c <= most and p in lasting for p, c in begin.items()) else set()


def _rounds(walk: Walk) -> dict[int, Costs]:
    """Return the ticks of the fastest round between poses of the last target."""
    return {
        pose: found
        for pose in bits(walk.targets[-1] & walk.allowed)
        if (found := _leg(walk, {pose: 0}))
    }


def _leg(walk: Walk, at: Costs) -> Costs:
    """Return the ticks to each pose of the last target through all targets."""
    for index in range(len(walk.targets)):
        at = _meet(walk, at, index)
    return at


def _meet(walk: Walk, at: Costs, index: int) -> dict[int, int]:
    """Return the ticks to each pose of a target that is met in a later tick than the previous one:
    by steps, or by staying for a tick. A target is met in the pose in which it is entered: no path
    leads through it."""
    if not at:
        return {}
    graph, goal, allowed = walk.graph, walk.targets[index] & walk.allowed, walk.allowed
    if walk.strict:
        for other, target in enumerate(walk.targets):
            allowed &= ~target if other != index else allowed
    layers: dict[int, Mask] = {}
    for pose, cost in at.items():
        layers[cost] = layers.get(cost, 0) | 1 << pose
    found: dict[int, int] = {}
    for pose, cost in at.items():
        if goal >> pose & 1:
            found[pose] = min(found.get(pose, FAR), cost + 1)
    seen, waiting = 0, layers
    while waiting:
        cost = min(waiting)
        frontier = waiting.pop(cost) & ~seen
        seen |= frontier
        step = graph.forward(frontier) & allowed
        for pose in bits(step & goal):
            found[pose] = min(found.get(pose, FAR), cost + walk.ticks)
        step &= ~seen & ~goal
        if step:
            waiting[cost + walk.ticks] = waiting.get(cost + walk.ticks, 0) | step
    return found
