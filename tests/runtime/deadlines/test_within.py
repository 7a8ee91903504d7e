"""Rounds of at most N ticks, against a game with a clock."""

import os
from dataclasses import dataclass
from random import Random

import pytest
from safenav.runtime.deadlines.round_deadlines import Walk, least_within

from campaigns.generate.build import walled
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
    strict: bool

    @property
    def walk(self) -> Walk:
        graph = PoseGraph(self.world, self.turns)
        masks = tuple(graph.poses_on(region_mask(target)) for target in self.targets)
        start, everywhere = graph.number(self.start), graph.everywhere
        return Walk(graph, masks, everywhere, start, self.ticks, strict=self.strict)


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
    return Rounds(world, turns, targets, start, ticks, random.random() < 0.25)


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
    start: Position = (asked.start.region, facing, 0, 0)
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


def test_the_heading_on_arrival_determines_the_length_of_the_next_round() -> None:
    grid = ["########", "#......#", "#...#..#", "#......#", "##.....#", "########"]
    graph = PoseGraph(RegionMap.from_grid(grid), Mobility.HEADING)
    targets = tuple(graph.poses_on(1 << region) for region in (12, 11))
    start = 30 + 2 * graph.size
    asked = Walk(graph, targets, graph.everywhere, start)
    assert least_within(asked) == 8
