"""Violation resolution (VR): who could remove an obstacle, and how far away each is.

Pure functions over what is known; choosing and reassigning is the task replanner's work
(paper, Section V-C).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from safenav.scenario.model import Obstacle, Robot
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Pose, distances


@dataclass(frozen=True)
class Bid:
    """One capable robot's answer to a request: steps to the nearest resolution region, None
    if it cannot get there."""

    robot: Robot
    distance: int | None


def bids(
    obstacle: Obstacle,
    team: Sequence[Robot],
    poses: Mapping[str, Pose],
    world: RegionMap,
    blocked: Mapping[str, Collection[Region]],
) -> list[Bid]:
    """The bids of all robots with the obstacle's action, in the team's order.

    ``blocked``: for each robot the regions beyond the walls that it cannot enter now.
    """
    places = obstacle.resolution_regions(world)
    found = []
    for robot in team:
        if obstacle.type.action not in robot.capabilities:
            continue
        reach = distances(robot.model.mobility, poses[robot.name], world, blocked[robot.name])
        known = [reach[place] for place in places if place in reach]
        found.append(Bid(robot, min(known, default=None)))
    return found


def ranking(offers: Sequence[Bid]) -> list[Robot]:
    """The bidders that can get there, nearest first, ties in the team's order."""
    able = [
        (bid.distance, place, bid.robot)
        for place, bid in enumerate(offers)
        if bid.distance is not None
    ]
    return [robot for _, _, robot in sorted(able, key=lambda entry: entry[:2])]
