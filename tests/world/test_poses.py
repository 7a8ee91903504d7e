"""Sets of poses, against searches that take one pose at a time."""

from collections.abc import Callable, Iterable
from random import Random

import pytest

from safenav.world.map import RegionMap
from safenav.world.poses import Mask, Mobility, PoseGraph, bits


def searched(
    steps: Callable[[int], Iterable[int]], start: Iterable[int], allowed: set[int]
) -> set[int]:
    found, left = set(start), [*start]
    while left:
        for other in steps(left.pop()):
            if other in allowed and other not in found:
                found.add(other)
                left.append(other)
    return found


def some(random: Random, poses: Mask) -> Mask:
    return sum(1 << pose for pose in bits(poses) if random.random() < 0.3)


@pytest.mark.parametrize("mobility", Mobility)
@pytest.mark.parametrize("seed", range(40))
def test_closures_are_those_of_single_steps(mobility: Mobility, seed: int) -> None:
    random = Random(seed)
    rows, cols = random.randint(1, 6), random.randint(1, 9)
    grid = ["".join(random.choice("...#") for _ in range(cols)) for _ in range(rows)]
    graph = PoseGraph(RegionMap.from_grid(grid), mobility)
    allowed = graph.everywhere & ~some(random, graph.everywhere)
    start, within = some(random, graph.everywhere), {*bits(allowed)}
    before: dict[int, list[int]] = {}
    for pose in bits(graph.everywhere):
        for step in graph.steps(pose):
            before.setdefault(step, []).append(pose)
    forward = searched(graph.steps, [*bits(start)], within)
    backward = searched(lambda pose: before.get(pose, ()), [*bits(start)], within)
    assert {*bits(graph.closure(start, allowed))} == forward
    assert {*bits(graph.back(start, allowed))} == backward
