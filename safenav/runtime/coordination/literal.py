"""Whether a robot by itself can patrol by the letter of the formula, for ever.

The letter is strict (paper, Section VI): a robot leaves a target at once, and never touches the
one whose turn it is not. So a corridor may be too narrow for it, or where the robot stands now may
be on the wrong side. A game of one player on sets of poses, in a fraction of a millisecond.
"""

from __future__ import annotations

from safenav.scenario.objective import Patrol
from safenav.scenario.pursuit import Pursuit
from safenav.world.moves import Pose
from safenav.world.poses import Mask, PoseGraph, region_mask


def can_patrol(
    graph: PoseGraph, pose: Pose, patrol: Patrol, memory: int, blocked: Mask = 0
) -> bool:
    """Whether a robot at ``pose`` that remembers ``memory`` can do so while some regions are
    ``blocked``: it can neither enter them nor stay there."""
    begun = Pursuit(patrol).begin(pose.region, memory)
    targets = [graph.poses_on(region_mask(target)) for target in (patrol.first, patrol.second)]
    open_poses = graph.everywhere & ~graph.poses_on(blocked)
    # Where the robot may be on its way, and of each target the poses that it can go on from.
    way = open_poses & ~targets[0] & ~targets[1]
    met = [targets[turn] & open_poses & ~targets[1 - turn] for turn in (0, 1)]
    while True:
        before = list(met)
        for turn in (0, 1):
            met[turn] &= graph.backward(graph.back(met[1 - turn], way))
        if met == before:
            break
    here = 1 << graph.number(pose)
    after = 1 - begun if here & targets[begun] else begun
    return bool(graph.forward(here) & graph.back(met[after], way))
