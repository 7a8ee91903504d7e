"""The state of a driven robot: its command and its odometry. The world owns it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from enum import Enum, auto
from math import hypot, inf

from msgspec import Struct, field

from safenav.fleet.file.stations import Station
from safenav.fleet.place import turned
from safenav.fleet.robots.acting import TeamAction
from safenav.fleet.robots.sensing import View
from safenav.fleet.transport import Located, Scanned
from safenav.scenario.model import Obstacle, Robot
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.moves import Pose

UNREAD = 100
"""Maximum number of scans of a robot that wait for its odometry."""
STILL = 0.05
"""Largest difference (metres, radians) between two measurements of a robot at rest."""


class Phase(Enum):
    """A phase of a command. INSPECTING: before the departure the robot senses the region that it
    will enter."""

    INSPECTING = auto()
    GOING = auto()
    STOPPING = auto()
    RETURNING = auto()
    LOOKING = auto()
    ACTING = auto()


class FleetTask(Struct):
    """A command under way. ``left``: number of times that its goal may still be sent; ``sent``:
    when it was last sent, and ``due``: time limit of its present phase, on the world's clock;
    ``back``: it failed, and the robot was sent back to its departure region; ``there``: odometry
    has confirmed the arrival, at time ``since``; ``over``: the results of an action and the reason
    of a failure, reported once odometry has the robot back in its region; ``known``: the obstacle
    known at the destination."""

    command: int
    start: Pose
    to: Pose
    left: int
    phase: Phase
    goal: int = 0
    sent: float = 0.0
    due: float = inf
    reason: str = ""
    team_action: TeamAction | None = None
    back: bool = False
    there: bool = False
    since: float = -inf
    over: tuple[list[tuple[Obstacle, ActResult]], str] | None = None
    known: Obstacle | None = None


class TrailPoint(Struct, frozen=True):
    """A past position of a robot, the time of its receipt in seconds, and the regions that the
    robot occupied then."""

    at: float
    place: Located
    regions: frozenset[Region]


class HeardScan(Struct, frozen=True):
    """A scan, and the time of its receipt in seconds."""

    at: float
    scan: Scanned


class DrivenRobot(Struct):
    """The state of a robot. ``heard``: when its newest odometry was received, on the world's clock;
    ``looked``: the stamp of its newest reading; ``arrived``: the stamp of its odometry at its
    newest arrival, since when it stands still; ``view``: its reading of the adjacent regions since
    then, received at ``viewed``; ``trail``: its last seconds, oldest first; ``unread``: scans newer
    than its odometry, ``newest`` the stamp of its newest scan; until ``deaf`` its scans are
    ignored; ``lost``: the regions in one of which it is, until a person places it."""

    robot: Robot
    station: Station
    pose: Pose
    place: Located | None = None
    heard: float = -inf
    looked: float = -inf
    arrived: float = -inf
    view: Mapping[Region, View] = field(default_factory=dict)
    viewed: float = -inf
    trail: deque[TrailPoint] = field(default_factory=deque)
    unread: deque[HeardScan] = field(default_factory=lambda: deque(maxlen=UNREAD))
    newest: float = -inf
    deaf: float = -inf
    lost: frozenset[Region] = frozenset()
    task: FleetTask | None = None

    @property
    def regions(self) -> frozenset[Region]:
        """Return the regions that the robot occupies: its own, those of its step, and those into
        which it reaches while acting."""
        task = self.task
        if task is None:
            return self.lost | {self.pose.region}
        acts = () if task.team_action is None else task.team_action.obstacles
        found = {self.pose.region, task.start.region, task.to.region}
        return self.lost | found | {obstacle.region for obstacle in acts}

    @property
    def stands(self) -> Region | None:
        """Return the region in which the robot stands; None if it moves, or its arrival is not
        confirmed."""
        task = self.task
        if task is None or task.phase is Phase.INSPECTING:
            return self.pose.region
        if task.phase is not Phase.LOOKING or not task.there:
            return None
        return (task.start if task.back else task.to).region

    def stood(self, stamp: float) -> Located | None:
        """Return the robot's position at rest at a stamp of its clock; None if it moved then, or if
        no odometry from before and after that time agrees on it."""
        newer: Located | None = None
        for point in reversed(self.trail):
            at = point.place
            if newer is not None and at.stamp > newer.stamp:
                return None  # its clock was set in between
            if at.stamp <= stamp:
                after = newer or at
                still = hypot(at.x - after.x, at.y - after.y) <= STILL
                exact = newer is not None or at.stamp == stamp
                return at if exact and still and abs(turned(at.yaw - after.yaw)) <= STILL else None
            newer = at
        return None
