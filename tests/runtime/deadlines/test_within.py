"""Rounds of at most N ticks, against a game with a clock; and the poses that make them short."""

from __future__ import annotations

import os
from dataclasses import replace
from random import Random

import pytest

from runtime.played import Runner
from safenav.runtime.deadlines.within import Walk, best_places, least_within, next_places
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


@pytest.mark.parametrize("seed", range(COUNT))
def test_what_can_be_promised_is_kept(seed: int) -> None:
    asked = walk(seed)
    least = None if asked is None else least_within(asked)
    if asked is None or least is None:
        return
    for _ in range(12):
        places = best_places(asked, least) or next_places(asked, least)
        assert places is not None
        end, ticks = walked(replace(asked, places=places))
        assert ticks <= least
        asked = replace(asked, start=end, first=0)


def walked(walk: Walk) -> tuple[int, int]:
    """Where a round by shortest legs ends that enters a target only in its places, and its
    ticks; of several ends the last."""
    at, ticks = {walk.start}, 0
    for target, places in list(zip(walk.targets, walk.places, strict=True))[walk.first :]:
        met = {pose for pose in at if target & places >> pose & 1}
        if met:
            at, ticks = met, ticks + 1
            continue
        seen = set(at)
        while at and not (met := {pose for pose in at if places >> pose & 1}):
            steps = {step for pose in at for step in walk.graph.steps(pose)}
            at = {p for p in steps - seen if not target >> p & 1 or places >> p & 1}
            seen, ticks = seen | at, ticks + walk.ticks
        assert met
        at = met
    return max(at), ticks


def test_the_heading_on_arrival_decides() -> None:
    grid = ["########", "#......#", "#...#..#", "#......#", "##.....#", "########"]
    graph = PoseGraph(RegionMap.from_grid(grid), Mobility.HEADING)
    targets = tuple(graph.poses_on(1 << region) for region in (12, 11))
    start = 30 + 2 * graph.size
    asked = Walk(graph, targets, graph.everywhere, start)
    assert least_within(asked) == 8
    assert best_places(asked, 8) is not None
    assert best_places(asked, 7) is None


NO_FIXED_CYCLE = """
safenav: 1
map:
  grid: ["######", "#....#", "#....#", "######"]
robots:
  r:
    model: digit
    start: [2, 2]
    heading: south
    objective: {visit: [[1, 3], [1, 4], [2, 1]], within: 8}
until: {rounds: 6}
"""


def test_a_round_has_places_of_its_own_where_none_serve_forever(run: Runner) -> None:
    played = run(NO_FIXED_CYCLE)
    assert (played.outcome["outcome"], played.outcome["late"]) == ("completed", [])
    assert played.all("synthesis", reason="round")


def test_the_tick_before_the_first_move_may_complete_a_round(run: Runner) -> None:
    text = NO_FIXED_CYCLE.replace("[[1, 3], [1, 4], [2, 1]], within: 8", "[[2, 2]], within: 1")
    played = run(text)
    kept = played.all("deadline", verdict="kept")
    assert [(line["tick"], line["due"]) for line in kept[:2]] == [(0, 1), (1, 1)]
    assert played.outcome["late"] == []
