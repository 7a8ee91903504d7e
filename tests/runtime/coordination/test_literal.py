"""Whether a robot alone can patrol by the letter, against the explicit game of one player."""

from __future__ import annotations

from random import Random

from safenav.explain.undisturbed import play
from safenav.runtime.coordination.literal import can_patrol
from safenav.scenario.objective import Patrol
from safenav.spec.objective import Memory
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, region_mask


def floor(*rows: str) -> RegionMap:
    return RegionMap.from_grid(rows)


def patrols(
    world: RegionMap, first: set[int], second: set[int], at: int, heading: Heading | None = None
) -> list[bool]:
    """With the first target next, and with the second."""
    mobility = Mobility.FREE if heading is None else Mobility.HEADING
    patrol = Patrol(frozenset(first), frozenset(second))
    graph = PoseGraph(world, mobility)
    return [can_patrol(graph, Pose(at, heading), patrol, memory) for memory in (0, 1)]


def test_a_corridor_is_patrolled_between_its_targets() -> None:
    assert patrols(floor("....."), {0}, {4}, at=2) == [True, True]


def test_who_stands_beyond_a_target_cannot_cross_it_when_it_is_not_its_turn() -> None:
    assert patrols(floor("....."), {1}, {4}, at=0) == [True, False]


def test_a_robot_with_a_heading_cannot_turn_round_at_the_end_of_a_corridor() -> None:
    assert patrols(floor("....."), {0}, {4}, at=2, heading=Heading.EAST) == [False, False]
    # Round a ring it can, if the target that comes first is the one whose turn it is.
    ring = floor("...", ".#.", "...")
    assert patrols(ring, {0}, {8}, at=1, heading=Heading.EAST) == [False, True]


def test_it_agrees_with_the_game_played_out() -> None:
    random = Random(11)
    counts = {True: 0, False: 0}
    for _ in range(400):
        rows, cols = random.randint(1, 4), random.randint(3, 6)
        world = floor(*("".join(random.choices("#.", (1, 4), k=cols)) for _ in range(rows)))
        if len(world.free) < 3:
            continue
        heading = random.choice([None, *Heading])
        mobility = Mobility.FREE if heading is None else Mobility.HEADING
        pose = Pose(random.choice(world.free), heading)
        some = random.sample(world.free, 3)
        patrol = Patrol(frozenset(some[:1]), frozenset(some[1 : random.randint(2, 3)]))
        blocked = frozenset(random.sample(world.free, random.randint(0, 2)))
        for memory in (0, 1):
            played = play(mobility, pose, patrol, Memory(memory), world, blocked).winnable
            graph = PoseGraph(world, mobility)
            told = can_patrol(graph, pose, patrol, memory, region_mask(blocked))
            assert told == played, (world.grid_rows(), pose, patrol, blocked, memory)
            counts[played] += 1
    assert min(counts.values()) > 100
