"""Shortest paths of poses, compared with those of networkx."""

import random

import networkx as nx
import pytest

from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, bits, region_mask


@pytest.mark.parametrize("first", range(0, 200, 100))
def test_a_path_is_shortest_and_enters_allowed_poses_only(first: int) -> None:
    for seed in range(first, first + 100):
        _compare(random.Random(seed))


def _compare(rng: random.Random) -> None:
    rows, cols = rng.randint(2, 6), rng.randint(2, 6)
    walls = frozenset(k for k in range(1, rows * cols) if rng.random() < 0.25)
    plain = PoseGraph(RegionMap(rows, cols, walls), rng.choice([*Mobility]))
    poses = list(bits(plain.everywhere))
    steps = [(pose, step) for pose in poses for step in plain.steps(pose)]
    closed = frozenset(ends for ends in steps if rng.random() < 0.1)
    graph = PoseGraph(plain.world, plain.mobility, closed)
    allowed = region_mask(pose for pose in poses if rng.random() < 0.9)
    start, goal = rng.choice(poses), rng.choice(poses)
    entered = [ends for ends in steps if ends not in closed and allowed >> ends[1] & 1]
    known = nx.DiGraph(entered)
    known.add_nodes_from((start, goal))
    path = graph.path(start, goal, allowed)
    if not nx.has_path(known, start, goal):
        assert path is None
        return
    assert path is not None
    assert (path[0], path[-1]) == (start, goal)
    assert nx.is_path(known, path)
    assert len(path) - 1 == nx.shortest_path_length(known, start, goal)
