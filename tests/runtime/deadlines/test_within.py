"""Rounds of at most N ticks, against a game with a clock; and the poses that make them short."""

import os
from dataclasses import dataclass
from random import Random

import pytest
from msgspec.structs import replace

from campaigns.generate.build import walled
from safenav.runtime.deadlines.round_deadlines import Walk, best_places, least_within, next_places
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, region_mask

FUZZ = int(os.environ.get("SAFENAV_FUZZ", "0"))
BATCHES, IN_BATCH = (FUZZ // 50 or 1, 20) if FUZZ else (3, 20)
"""``SAFENAV_FUZZ=5000`` asks about 2,000 walks: each of its least promise, and of the next lower
one."""


@dataclass(frozen=True)
class Rounds:
    """What a walk is about, as regions: the game below shares nothing with ``Walk``."""

    world: RegionMap
    turns: Mobility
    targets: tuple[frozenset[int], ...]
    start: Pose
    ticks: int
    first: int
    strict: bool

    @property
    def walk(self) -> Walk:
        graph = PoseGraph(self.world, self.turns)
        masks = tuple(graph.poses_on(region_mask(target)) for target in self.targets)
        start, everywhere = graph.number(self.start), graph.everywhere
        return Walk(graph, masks, everywhere, start, self.ticks, self.first, strict=self.strict)


def rounds(seed: int) -> Rounds:
    random = Random(f"rounds {seed}")
    while True:
        rows, cols = random.randint(2, 4), random.randint(3, 6)
        world = RegionMap.from_grid(walled(random, rows, cols, 0.2))
        if len(world.free) >= 6:
            break
    turns = random.choice((Mobility.FREE, Mobility.HEADING, Mobility.HEADING))
    free, count = sorted(world.free), random.choice((1, 2, 2, 3))
    places = random.sample(free, 6)
    targets = tuple(
        frozenset(places[2 * k : 2 * k + random.choice((1, 1, 2))]) for k in range(count)
    )
    facing = random.choice(list(Heading)) if turns is Mobility.HEADING else None
    start, ticks = Pose(random.choice(free), facing), random.choice((1, 1, 2, 3))
    return Rounds(
        world, turns, targets, start, ticks, random.randrange(count), random.random() < 0.25
    )


Position = tuple[int, int | None, int, int]  # region, heading, next target, ticks of this round


def moves(asked: Rounds, at: Position, most: int) -> list[Position]:
    """Return the moves in a position of the game with a clock."""
    region, facing, index, clock = at
    world, found = asked.world, []
    steps = [(region, facing, 1)]
    for side, (down, right) in enumerate(((-1, 0), (0, 1), (1, 0), (0, -1))):
        row, col = region // world.cols + down, region % world.cols + right
        to = row * world.cols + col
        inside = 0 <= row < world.rows and 0 <= col < world.cols and to not in world.walls
        if not inside or (facing is not None and side == (facing + 2) % 4):
            continue
        others = set().union(*asked.targets) - asked.targets[index]
        if not (asked.strict and to in others):
            steps.append((to, None if facing is None else side, asked.ticks))
    for to, turned, ticks in steps:
        if clock + ticks > most:
            continue
        met = to in asked.targets[index]
        after = (index + met) % len(asked.targets)
        found.append((to, turned, after, 0 if met and after == 0 else clock + ticks))
    return found


def keeps(asked: Rounds, most: int) -> bool:
    """Whether rounds of at most ``most`` ticks are possible for ever: a game whose positions
    without a successor are removed until none are left."""
    facing = None if asked.start.heading is None else int(asked.start.heading)
    start: Position = (asked.start.region, facing, asked.first, 0)
    before: dict[Position, list[Position]] = {start: []}
    left, queue = dict[Position, int](), [start]
    while queue:
        at = queue.pop()
        after = moves(asked, at, most)
        left[at] = len(after)
        for to in after:
            if to not in before:
                before[to] = []
                queue.append(to)
            before[to].append(at)
    dead = [at for at, number in left.items() if not number]
    while dead:
        for at in before[dead.pop()]:
            left[at] -= 1
            if not left[at]:
                dead.append(at)
    return left[start] > 0


@pytest.mark.parametrize("number", range(BATCHES))
def test_the_least_ticks_of_a_round_are_exact(number: int) -> None:
    for seed in range(number * IN_BATCH, (number + 1) * IN_BATCH):
        asked = rounds(seed)
        least = least_within(asked.walk)
        if least is None:
            assert not keeps(asked, 100)
            continue
        assert keeps(asked, least)
        assert not keeps(asked, least - 1)
        places = best_places(asked.walk, least)
        if places is not None:  # it walks round by round from pose to pose, each the only one
            assert all(place & (place - 1) == 0 for place in places)


@pytest.mark.parametrize("number", range(BATCHES))
def test_rounds_keep_the_least_ticks_that_were_promised(number: int) -> None:
    for seed in range(number * IN_BATCH, (number + 1) * IN_BATCH):
        asked = rounds(seed).walk
        least = least_within(asked)
        if least is None:
            continue
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


def test_the_heading_on_arrival_determines_the_length_of_the_next_round() -> None:
    grid = ["########", "#......#", "#...#..#", "#......#", "##.....#", "########"]
    graph = PoseGraph(RegionMap.from_grid(grid), Mobility.HEADING)
    targets = tuple(graph.poses_on(1 << region) for region in (12, 11))
    start = 30 + 2 * graph.size
    asked = Walk(graph, targets, graph.everywhere, start)
    assert least_within(asked) == 8
    assert best_places(asked, 8) is not None
    assert best_places(asked, 7) is None


def test_a_target_is_met_where_it_is_entered_first() -> None:
    """Region 21 is next, and beside the robot: its round ends as it enters it facing east, and from
    there the next one takes 24 ticks, not 18 as from where a longer way would end."""
    grid = ["######", "#....#", "#..#.#", "#....#", "#....#", "######"]
    world, corner = RegionMap.from_grid(grid), frozenset([8, 13])
    targets = (corner, frozenset([22]), frozenset([10]))
    asked = Rounds(world, Mobility.HEADING, targets, Pose(9, Heading.EAST), 2, 2, False)
    assert least_within(asked.walk) == 24
    assert keeps(asked, 24)
    assert not keeps(asked, 23)
    assert next_places(asked.walk, 24) is not None
