"""Environment characterization (EC): whether the actual world allows a proposed move.

Source: paper, Section V-A.
"""

from __future__ import annotations

from msgspec import Struct

from safenav.runtime.team import TeamState
from safenav.runtime.worlds.commands import Commands
from safenav.scenario.model import Obstacle, Robot
from safenav.world.map import Region
from safenav.world.moves import Pose


class ForbiddenMove(Struct, frozen=True):
    """A proposed move that the augmented specification forbids (paper, eq. for phi_a)."""

    robot: Robot
    at: Region
    proposed: Region
    obstacle: Obstacle


def characterize(
    world: Commands, team: TeamState, robot: Robot, pose: Pose, target: Region
) -> ForbiddenMove | None:
    """Return the violation of knowledge or observation by moving from ``pose`` to ``target``, or
    None. A known obstacle stays closed until an event opens it, regardless of sensors. Until then
    a robot that has entered it may only go back."""
    if target == pose.region:
        return None
    around = team.knowledge.around(pose.region, robot)
    came = team.robots[robot.name].came
    if around is not None and came is not None and target != came.region:
        return ForbiddenMove(robot, pose.region, pose.region, around)
    obstacle = team.knowledge.closing(target, robot)
    if obstacle is None:
        obstacle = world.sense(robot, target)
        if obstacle is None:
            return None
        team.knowledge.sight(obstacle)  # a sensor may miss it next time
        if not team.knowledge.closed_to(obstacle, robot):
            return None
    return ForbiddenMove(robot, pose.region, target, obstacle)
