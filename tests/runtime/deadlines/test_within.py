"""Rounds of at most N ticks, against a game with a clock; and the poses that make them short."""

from __future__ import annotations

import os
from random import Random

import pytest

from safenav.runtime.deadlines.within import Walk, best_places, least_within
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, bits

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 60


def walk(seed: int) -> Walk | None:
    random = Random(seed)
    rows, cols = random.randint(2, 4), random.randint(3, 6)
    wall = "#" * (cols + 2)
    inside = [
        "".join("#" if random.random() < 0.2 else "." for _ in range(cols)) for _ in range(rows)
    ]
    graph = PoseGraph(
        RegionMap.from_grid([wall, *(f"#{row}#" for row in inside), wall]),
        random.choice((Mobility.FREE, Mobility.HEADING, Mobility.HEADING)),
    )
    free = sorted({pose % graph.size for pose in bits(graph.everywhere)})
    if len(free) < 4:
        return None
    targets = random.sample(free, random.choice((1, 2, 2, 3)))
    start = random.choice(list(bits(graph.everywhere)))
    masks = tuple(graph.poses_on(1 << target) for target in targets)
    return Walk(graph, masks, graph.everywhere, start, random.choice((1, 1, 2)))


def keeps(walk: Walk, most: int) -> bool:
    """Whether rounds of at most ``most`` ticks are possible for ever: a game on pose, next target
    and ticks of this round, whose positions without a successor are removed until none are left."""
    number = len(walk.targets)

    def after(state: tuple[int, int, int]) -> list[tuple[int, int, int]]:
        pose, index, clock = state
        found = []
        moves = [(pose, 1)] + [(step, walk.ticks) for step in walk.graph.steps(pose)]
        for step, ticks in moves:
            if clock + ticks > most:
                continue
            if not walk.targets[index] >> step & 1:
                found.append((step, index, clock + ticks))
            elif index + 1 == number:
                found.append((step, 0, 0))
            else:
                found.append((step, index + 1, clock + ticks))
        return found

    start = (walk.start, 0, 0)
    seen, queue = {start}, [start]
    while queue:
        for state in after(queue.pop()):
            if state not in seen:
                seen.add(state)
                queue.append(state)
    alive = set(seen)
    while True:
        rest = {state for state in alive if any(one in alive for one in after(state))}
        if rest == alive:
            return start in alive
        alive = rest


@pytest.mark.parametrize("seed", range(COUNT))
def test_the_least_promise_is_exact(seed: int) -> None:
    asked = walk(seed)
    if asked is None:
        return
    least = least_within(asked)
    if least is None:
        assert not keeps(asked, 60)
        return
    assert keeps(asked, least)
    assert least == 1 or not keeps(asked, least - 1)
    places = best_places(asked, least)
    if places is not None:  # it walks round by round from pose to pose, each the only one
        assert all(place & (place - 1) == 0 for place in places)


def test_the_heading_on_arrival_decides() -> None:
    grid = ["########", "#......#", "#...#..#", "#......#", "##.....#", "########"]
    graph = PoseGraph(RegionMap.from_grid(grid), Mobility.HEADING)
    targets = tuple(graph.poses_on(1 << region) for region in (12, 11))
    start = 30 + 2 * graph.size
    asked = Walk(graph, targets, graph.everywhere, start)
    assert least_within(asked) == 8
    assert best_places(asked, 8) is not None
    assert best_places(asked, 7) is None
