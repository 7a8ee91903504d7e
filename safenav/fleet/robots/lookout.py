"""Evaluation of scans at the poses where they were taken, and detection of robots out of place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from math import hypot

from safenav.fleet.place import Places
from safenav.fleet.robots.driven_robot import DrivenRobot, HeardScan
from safenav.fleet.robots.sensing import PASSED, ScanResult, Sensing, View
from safenav.fleet.transport import Located, Scanned
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.failures import lost
from safenav.world.map import Region

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
        body.unread.append(HeardScan(heard, scan))

    def read(self, body: DrivenRobot, now: float) -> Iterator[ScanResult]:
        """Evaluate the scans whose poses are known from odometry by now."""
        while body.unread and body.place is not None:
            heard, scan = body.unread[0].at, body.unread[0].scan
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
