"""The judge's own line of sight agrees with the one that specifications are written from."""

import random

import pytest

from safenav.judge.bundle.strategies import sees
from safenav.judge.world import World
from safenav.world.map import RegionMap
from safenav.world.sight import visible_from


@pytest.mark.parametrize("seed", range(30))
def test_both_implementations_see_the_same_on_random_maps(seed: int) -> None:
    rng = random.Random(seed)
    rows, cols = rng.randint(1, 7), rng.randint(2, 7)
    cells = ["#" if rng.random() < 0.2 else "." for _ in range(rows * cols)]
    cells[rng.randrange(rows * cols)] = "."
    picture = tuple("".join(cells[i * cols : (i + 1) * cols]) for i in range(rows))
    world = RegionMap.from_grid(picture)
    grid = World(rows, cols, world.walls)
    free = sorted(world.free)
    closed = frozenset(rng.sample(free, min(len(free), rng.randint(0, 3))))
    radius = rng.choice([None, 1, 1.5, 2, 3, 4.2])
    visibility = visible_from(world, radius, closed)
    for one in free:
        for other in free:
            assert sees(grid, one, other, radius, closed) == visibility.sees(one, other)
