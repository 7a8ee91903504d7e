"""Waiting regions that block no helper (paper, Section V-D: safe behaviour that does not
interfere with the helping agent).

A region is in the way if a robot there would keep some helper in conflict with it out of every pose
of the helper's duty, or keep a group from standing there together.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from safenav.runtime.duties.settlement import Duty
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.resolution.solve import fits
from safenav.world.map import Region
from safenav.world.poses import Mask, bits


def in_the_way(floor: Floor, duties: Mapping[int, Duty], robot: int, region: Region) -> bool:
    """Whether a robot in ``region`` blocks a helper."""
    problem = floor.problem
    for helper in problem.conflicts[robot] & duties.keys():
        duty = duties[helper]
        places: dict[int, Mask] = {}
        for one in duty.group:
            graph = problem.members[one].graph
            closed = graph.poses_on(1 << region) if one in problem.conflicts[robot] else 0
            allowed = problem.allowed(one, floor.stages) & ~closed
            goal = duties[one].goal if one in duties else duty.goal
            places[one] = graph.closure(1 << floor.poses[one], allowed) & goal & ~closed
        together = problem.gates[duty.gate].needs[duty.need].together
        if not all(places.values()) or (together and not fits(problem, duty.group, places)):
            return True
    return False


def clear_region(
    floor: Floor, duties: Mapping[int, Duty], robot: int, safe: Mask, taken: Collection[Region]
) -> Region | None:
    """Return the nearest region, through ``safe`` poses and not in ``taken``, in which a robot
    blocks no helper; None if there is none."""
    graph = floor.problem.members[robot].graph
    allowed = floor.problem.allowed(robot, floor.stages) & safe
    found = frontier = 1 << floor.poses[robot]
    while frontier:
        for region in bits(graph.regions_of(frontier)):
            if region not in taken and not in_the_way(floor, duties, robot, region):
                return region
        frontier = graph.forward(frontier) & allowed & ~found
        found |= frontier
    return None
