"""Situations of a mission, from which the judge decides whether it can still be completed."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from campaigns.judge.mission import Mission, Obstacle, Pose


class Answer(Enum):
    """Whether the mission can be completed."""

    YES = "yes"
    NO = "no"
    OVER_BUDGET = "over budget"


Stage = tuple[int, frozenset[str]]
"""Of an obstacle: the index of the next need, and who has performed it already."""

FIRST: Stage = (0, frozenset())

Progress = tuple[int, int]
"""Of a robot: what is next (``in_order``: an index; otherwise the targets covered, bit by bit),
and how many goals (otherwise: rounds) it has met since the last resolution."""


@dataclass(frozen=True)
class Situation:
    """A moment of a mission. ``stages``: the obstacles that are known and unresolved; those not
    listed are absent. ``sealed``: those found to be permanent."""

    poses: Mapping[str, Pose]
    progress: Mapping[str, Progress]
    stages: Mapping[str, Stage]
    sealed: frozenset[str] = frozenset()


def at_start(mission: Mission) -> Situation:
    """Return the situation before the first move: hidden obstacles count as absent."""
    return Situation(
        {robot.name: robot.start for robot in mission.robots},
        {robot.name: (0, 0) for robot in mission.robots},
        {},
    )


def walls(
    mission: Mission, name: str, stages: Mapping[str, Stage], sealed: frozenset[str]
) -> frozenset[int]:
    """The regions that obstacles close to a robot."""
    robot = next(one for one in mission.robots if one.name == name)

    def closes(obstacle: Obstacle) -> bool:
        if obstacle.name in sealed:
            return name in obstacle.blocks
        stage = stages.get(obstacle.name)
        return stage is not None and mission.blocked(robot, obstacle, stage[0])

    return frozenset(one.region for one in mission.obstacles.values() if closes(one))
