"""Rounds of at most N ticks, forever, by one robot alone: exact, and without a counter.

K is the greatest set of poses of the last target from which another round of at most N ticks leads
back into K; the robot meets the deadline forever iff its first round leads into K in time. A
strategy that meets each target only in the poses of the best rounds does so: its legs are shortest
paths.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct
from msgspec.structs import replace

from safenav.world.poses import FAR, Mask, PoseGraph, bits, region_mask

Costs = Mapping[int, int]
"""The steps to each pose."""


class Walk(Struct, frozen=True, eq=False):
    """A robot's rounds: its ``targets`` as pose masks, met in turn, inside ``allowed`` poses;
    ``ticks`` of each step; its start and the next target there. ``places``: the only poses in which
    each target may be entered while it is next (none: any); ``strict``: the other targets are not
    touched on the way (the paper's patrol)."""

    graph: PoseGraph
    targets: tuple[Mask, ...]
    allowed: Mask
    start: int
    ticks: int = 1
    first: int = 0
    places: tuple[Mask, ...] = ()
    strict: bool = False


def least_within(walk: Walk) -> int | None:
    """Return the least N such that every round can take at most N ticks; None if there is none."""
    costs, begin = _rounds(walk), _leg(walk, {walk.start: 0}, walk.first)
    values = sorted({*begin.values(), *(c for row in costs.values() for c in row.values())})
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if _kept(costs, begin, values[middle]):
            high = middle
        else:
            low = middle + 1
    return values[low] if low < len(values) else None


def best_places(walk: Walk, most: int) -> tuple[Mask, ...] | None:
    """Return for each target the poses in which to meet it, so that shortest legs between them give
    rounds of at most ``most`` ticks; None if no such choice is found."""
    costs, begin = _rounds(walk), _leg(walk, {walk.start: 0}, walk.first)
    lasting = _kept(costs, begin, most)
    for last in sorted(lasting, key=lambda pose: (costs[pose].get(pose, FAR), pose)):
        if costs[last].get(last, FAR) > most:
            continue
        narrow = _traced(walk, last, 0, last)
        if keep(walk, narrow, most):
            return narrow
    return None


def next_places(walk: Walk, most: int) -> tuple[Mask, ...] | None:
    """Return for each target the poses in which to meet it in the present round only, so that all
    later rounds can also be in time; None if that is impossible. Exact: a new call after each round
    keeps every deadline that can be kept."""
    costs, begin = _rounds(walk), _leg(walk, {walk.start: 0}, walk.first)
    lasting = _kept(costs, begin, most)

    def rank(pose: int) -> tuple[bool, int, int]:
        return costs[pose].get(pose, FAR) > most, begin[pose], pose

    for last in sorted((p for p in lasting if begin.get(p, FAR) <= most), key=rank):
        narrow = _traced(walk, walk.start, walk.first, last)
        there = _leg(replace(walk, places=narrow), {walk.start: 0}, walk.first)
        if there.get(last, FAR) > most:
            continue
        for places in (narrow, _widened(walk, narrow)):
            if least_within(replace(walk, places=places)) is not None:
                return places  # a strategy can repeat such rounds forever
    return None


def _widened(walk: Walk, narrow: tuple[Mask, ...]) -> tuple[Mask, ...]:
    """Return the same places, extended by all poses in which shortest legs from the robot's start
    do not end."""
    found, at = list(narrow), walk.start
    for index in range(walk.first, len(narrow)):
        (leg,) = _meet(replace(walk, places=narrow), {at: 0}, index).values()
        near = [pose for pose, ticks in _meet(walk, {at: 0}, index).items() if ticks <= leg]
        found[index] |= (walk.places or walk.targets)[index] & ~region_mask(near)
        at = narrow[index].bit_length() - 1
    return tuple(found)


def _traced(walk: Walk, start: int, first: int, last: int) -> tuple[Mask, ...]:
    """Return the pose of each target on a fastest path from ``start`` to ``last`` through the
    targets from number ``first`` on; for earlier targets all poses."""
    places = list(walk.places or walk.targets)
    legs: list[Costs] = [{start: 0}]
    for index in range(first, len(walk.targets)):
        legs.append(_meet(walk, legs[-1], index))
    pose = last
    for index in reversed(range(first, len(walk.targets))):
        places[index] = 1 << pose
        back = legs[index - first]
        pose = min(back, key=lambda p: (back[p] + _meet(walk, {p: 0}, index).get(pose, FAR), p))
    return tuple(places)


def keep(walk: Walk, places: tuple[Mask, ...], most: int) -> bool:
    """Return whether shortest legs to these places keep every round in time if a target's other
    poses are closed while it is next."""
    least = least_within(replace(walk, places=places))
    return least is not None and least <= most


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
        for pose in bits((walk.places or walk.targets)[-1] & walk.allowed)
        if (found := _leg(walk, {pose: 0}, 0))
    }


def _leg(walk: Walk, at: Costs, first: int) -> Costs:
    """Return the ticks to each pose of the last target through the targets from number ``first``
    on."""
    for index in range(first, len(walk.targets)):
        at = _meet(walk, at, index)
    return at


def _meet(walk: Walk, at: Costs, index: int) -> dict[int, int]:
    """Return the ticks to each pose of a target that is met in a later tick than the previous one:
    by steps, or by staying for a tick. A target is met in the pose in which it is entered: no path
    leads through it."""
    if not at:
        return {}
    graph, goal, allowed = walk.graph, walk.targets[index] & walk.allowed, walk.allowed
    if walk.places:
        allowed &= ~(goal & ~walk.places[index])
        goal &= walk.places[index]
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
