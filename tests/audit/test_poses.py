"""What can be reached in the audit's graphs of poses, compared with networkx."""

import random

import networkx as nx
import pytest

from safenav.audit.language import Pose
from safenav.audit.poses import PoseGraph


@pytest.mark.parametrize("first", range(0, 150, 50))
def test_reach_and_return_are_those_of_the_graph(first: int) -> None:
    for seed in range(first, first + 50):
        _compare(random.Random(seed))


def _compare(rng: random.Random) -> None:
    poses: list[Pose] = [(k, None) for k in range(rng.randint(1, 9))]
    graph = PoseGraph(
        (p, tuple(rng.sample(poses, min(len(poses), rng.randint(0, 2))))) for p in poses
    )
    for _ in range(4):  # later queries use the results of earlier ones
        walls = frozenset(k for k, _ in poses if rng.random() < 0.2)
        starts = frozenset(rng.sample(poses, rng.randint(1, len(poses))))
        aims = tuple(
            frozenset(rng.sample(poses, rng.randint(0, len(poses))))
            for _ in range(rng.randint(0, 2))
        )
        known = nx.DiGraph((p, q) for p, to in graph.items() for q in to if q[0] not in walls)
        known.add_nodes_from(poses)
        reach = starts.union(*(nx.descendants(known, p) for p in starts))
        assert graph.reach(starts, walls) == reach
        open_ = known.subgraph(p for p in poses if p[0] not in walls)
        parts = list(nx.strongly_connected_components(open_))
        for start in starts & {*open_}:
            assert {*graph.spread(start, walls).around} in parts
        lasting = any(part <= reach and all(aim & part for aim in aims) for part in parts)
        assert graph.can_continue(starts, aims, walls) == lasting
