"""The commands of a fleet that are under way, and its robots: state that the world owns."""

from __future__ import annotations

from enum import Enum, auto
from math import inf

from msgspec import Struct

from safenav.fleet.acting import TeamAction
from safenav.fleet.fleet_file import Station
from safenav.fleet.transport import Located
from safenav.scenario.model import Robot
from safenav.world.map import Region
from safenav.world.moves import Pose


class Phase(Enum):
    """A phase of a command."""

    GOING = auto()
    STOPPING = auto()
    RETURNING = auto()
    LOOKING = auto()
    ACTING = auto()


class FleetTask(Struct):
    """A command under way. ``left``: times that its goal may be sent again; ``due``: when its
    present phase is to be over, on the world's clock; ``back``: it failed, and the robot was sent
    back to where it set out."""

    command: int
    start: Pose
    to: Pose
    left: int
    phase: Phase
    goal: int = 0
    due: float = inf
    reason: str = ""
    since: float = -inf
    team_action: TeamAction | None = None
    back: bool = False


class DrivenRobot(Struct):
    """The state of a robot. ``heard``: when its newest odometry came, on the world's clock;
    ``looked``: the stamp of its newest reading."""

    robot: Robot
    station: Station
    pose: Pose
    place: Located | None = None
    heard: float = -inf
    looked: float = -inf
    task: FleetTask | None = None

    @property
    def regions(self) -> frozenset[Region]:
        """Those that it has: where it stands, and those of its step."""
        step = (self.task.start, self.task.to) if self.task is not None else ()
        return frozenset(pose.region for pose in (self.pose, *step))
