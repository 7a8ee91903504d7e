"""Driven robots: their commands and odometry, which the world owns, the evaluation of their scans
at the poses where they were taken, and the detection of robots out of place.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from enum import Enum, auto
from functools import partial
from math import hypot, inf

from msgspec import Struct, field

from safenav.fleet.file import Station
from safenav.fleet.place import Places, turned
from safenav.fleet.robots.acting import TeamAction
from safenav.fleet.robots.sensing import PASSED, ScanResult, Sensing, View
from safenav.fleet.transport import Located, Scanned
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.failures import lost
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.poses import Pose

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


class DrivenRobot(Struct):
    """The state of a robot. ``heard``: when its newest odometry was received, on the world's clock;
    ``looked``: the stamp of its newest reading; ``arrived``: the stamp of its odometry at its
    newest arrival, since when it stands still; ``view``: its reading of the adjacent regions since
    then, received at ``viewed``; ``trail``: its last seconds, oldest first; ``unread``: scans newer
    than its odometry, each with the time of its receipt, ``newest`` the stamp of its newest scan;
    until ``deaf`` its scans are ignored; ``lost``: the regions in one of which it is, until a
    person places it."""

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
    unread: deque[tuple[float, Scanned]] = field(default_factory=lambda: deque(maxlen=UNREAD))
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


STALE = 2.0
"""Seconds without odometry after which a robot's position is unknown."""


class Lookout:
    """Evaluates robots' scans, and detects robots in regions to which they were not sent."""

    def __init__(
        self,
        scenario: Scenario,
        places: Places,
        bodies: Mapping[str, DrivenRobot],
        sensing: Sensing,
    ) -> None:
        self._scenario = scenario
        self._places = places
        self._bodies = bodies
        self._sensing = sensing
        self._strays: dict[str, Obstacle] = {}

    def stray(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return the obstacle that represents another robot in a region to which it was not sent:
        it has left its path, or a person has moved it."""
        for body in self._bodies.values():
            at = body.place
            if at is None or not robot.conflicts(body.robot):
                continue
            held = body.regions
            off = min(self._places.outside(one, at.x, at.y) for one in held)
            if off > body.station.tolerance and self._places.region(at.x, at.y) == region:
                team = self._scenario.robots
                rivals = [o.name for o in team if o.conflicts(body.robot)]
                found = lost(body.robot, frozenset(rivals), region)
                return self._strays.setdefault(body.robot.name, found)
        return None

    def stray_left(self, body: DrivenRobot) -> Obstacle | None:
        """Return the obstacle that represented this robot in a region that it has left; None if
        there is none."""
        at, found = body.place, self._strays.get(body.robot.name)
        if found is None or at is None or self._places.region(at.x, at.y) == found.region:
            return None
        return self._strays.pop(body.robot.name)

    def placed(self, robot: str) -> None:
        """Record that an operator has placed a robot in the region where the team expects it."""
        self._strays.pop(robot, None)

    def is_shared(self, body: DrivenRobot, region: Region) -> bool:
        """Return whether another robot in a region does not conflict with this one, such as a flyer
        above it."""
        return any(
            region in other.regions and not body.robot.conflicts(other.robot)
            for other in self._bodies.values()
            if other is not body
        )

    def keep(self, body: DrivenRobot, scan: Scanned, heard: float) -> None:
        """Keep a scan until odometry shows where it was taken: either may be late."""
        if body.station.scan is None or heard < body.deaf or scan.stamp <= body.newest:
            return  # this also drops scans of a clock that was set back, until odometry shows it
        body.newest = scan.stamp
        body.unread.append((heard, scan))

    def read(self, body: DrivenRobot, now: float) -> Iterator[ScanResult]:
        """Evaluate the scans whose poses are known from odometry by now."""
        while body.unread and body.place is not None:
            heard, scan = body.unread[0]
            if now - heard <= STALE and scan.stamp > body.place.stamp:
                return
            body.unread.popleft()
            found = self._scan(body, scan, heard) if now - heard <= STALE else None
            if found is not None:
                yield found

    def _scan(self, body: DrivenRobot, scan: Scanned, heard: float) -> ScanResult | None:
        """Evaluate the regions beside the robot from a scan taken at rest at its present pose;
        return None for any other scan."""
        use, here = body.station.scan, body.stands
        if use is None or here is None or scan.stamp <= max(body.looked, body.arrived):
            return None
        at = body.stood(scan.stamp)
        if at is None or self._places.region(at.x, at.y) != here:
            return None
        body.looked = scan.stamp
        look = self._sensing.scan(use, scan, at, here, partial(self._whose, body, heard), heard)
        body.view, body.viewed = look.view, heard
        return look

    def _whose(
        self, body: DrivenRobot, heard: float, region: Region, x: float, y: float
    ) -> View | None:
        """Return ROBOT if a ray that ended in a region at a point (metres) may have hit another
        robot, which is near that point or moves through the region; DOUBT if one was, or did,
        within ``PASSED`` seconds before the scan was received; else None."""
        view = None
        for other in self._bodies.values():
            if other is body:
                continue
            if region in other.regions or self._touches(other, other.place, x, y):
                return View.ROBOT
            if any(
                point.at >= heard - PASSED
                and (region in point.regions or self._touches(other, point.place, x, y))
                for point in other.trail
            ):
                view = View.DOUBT
        return view

    def _touches(self, body: DrivenRobot, place: Located | None, x: float, y: float) -> bool:
        """Return whether a robot's body may extend to a point from a place."""
        size = body.robot.model.size
        half = min(self._places.frame.resolution) / 2
        reach = half if size is None else size / 2
        return place is not None and hypot(place.x - x, place.y - y) < reach + half
