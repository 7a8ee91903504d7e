"""Obstacles that a fleet has detected: lidar rays and reports mapped to regions.

All robots share their sightings. A reading taken before the resolution of an obstacle does not
restore it: only stamps of the same robot are compared.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from math import cos, hypot, inf, isfinite, isnan, pi, sin

from msgspec import Struct

from safenav.fleet.file import ScanUse
from safenav.fleet.robots import PASSED, STALE, DrivenRobot, View
from safenav.fleet.transport import Located, Places, Reported, Scanned, turned
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.failures import lost
from safenav.world.map import Region

FRESH_SIGHT = 2.0
"""Seconds for which a sighting by one sensor outweighs a miss by another: a leaf is thin when seen
edge-on, and messages may be late."""

BEFORE = 0.1
"""Share of a region's side by which the end of a ray must be outside it to count as before the
region, or past its middle to count as behind it."""

NARROW, WIDE = 0.1, 0.3
"""Maximum distances of rays from the line to a region's middle, as shares of its side: NARROW to
detect an obstacle, WIDE to find that it is gone, since the leaves of a door that is ajar are beside
the middle."""


class Sighting(Struct, frozen=True):
    """A report that an obstacle is present, or no longer present."""

    obstacle: Obstacle
    there: bool


class ScanResult(Struct, frozen=True):
    """The meaning of one scan: new sightings, and a view of each region beside the robot."""

    found: tuple[Sighting, ...]
    view: Mapping[Region, View]


class Sensing:
    """The obstacles known to be present now, by region."""

    def __init__(self, scenario: Scenario, places: Places) -> None:
        self._scenario = scenario
        self._places = places
        self._seen: dict[Region, Obstacle] = {}
        self._resolved_at: dict[Region, dict[str, float]] = {}
        self._resolved: dict[Region, float] = {}
        self._hit: dict[tuple[Region, str], float] = {}
        """Time at which each sensor last detected the obstacle of a region."""
        self.acted_on: set[Region] = set()
        """Regions whose obstacle a robot acts on: the result of the action shows whether it is
        gone."""

    def at(self, region: Region) -> Obstacle | None:
        return self._seen.get(region)

    def seen(self) -> Iterable[Obstacle]:
        """Return the obstacles known to be present."""
        return self._seen.values()

    def forget(self, region: Region, stamps: Mapping[str, float], now: float) -> None:
        """Discard a resolved obstacle. ``stamps``: stamp of each robot's newest odometry."""
        self._seen.pop(region, None)
        self._hit = {key: at for key, at in self._hit.items() if key[0] != region}
        self._resolved_at[region] = dict(stamps)
        self._resolved[region] = now

    def clock_was_set(self, robot: str, stamp: float) -> None:
        """Adapt to a robot's clock that was set back to ``stamp``."""
        for stamps in self._resolved_at.values():
            stamps[robot] = min(stamps.get(robot, -inf), stamp)

    def report(self, message: Reported, stamp: float, now: float) -> list[Sighting]:
        """Process a report, ``door@47`` or ``-door@47``; ignore any other text."""
        there = not message.text.startswith("-")
        kind, _, place = message.text.removeprefix("-").strip().partition("@")
        region = self._scenario.map.names.get(place)
        if region is None and place.isdecimal() and len(place) < 10:
            region = int(place)
        if region is None or kind not in self._scenario.catalogue.obstacles:
            return []
        source = f"report of {message.robot}"
        if there:
            if self._is_past(region, now):
                return []
            self._hit[region, source] = now
            return self._saw(message.robot, region, kind, stamp)
        return self._missing(message.robot, region, stamp, now, source)

    def scan(
        self,
        use: ScanUse,
        scan: Scanned,
        at: Located,
        here: Region,
        whose: Callable[[Region, float, float], View | None],
        now: float,
    ) -> ScanResult:
        """Evaluate the regions adjacent to ``here`` by a scan taken at ``at`` and received at
        ``now`` (seconds). ``whose``: whether a ray into a region that ended at x and y (metres) may
        have hit another robot. An obstacle that another sensor still detects is not gone."""
        found: list[Sighting] = []
        view: dict[Region, View] = {}
        side = min(self._places.frame.resolution)
        beyond = use.metres(side)
        for region in self._scenario.map.neighbours(here):
            hit, known = self._nearest(scan, at, region), self._seen.get(region)
            if hit is None:
                view[region] = View.UNSEEN
                continue
            far = self._places.distance(region, at.x, at.y) + beyond
            if hit > far:
                view[region] = View.FREE
                wide = self._nearest(scan, at, region, WIDE)
                ajar = wide is not None and wide <= far
                if known is not None and known.type.name == use.obstacle and not ajar:
                    found += self._missing(scan.robot, region, scan.stamp, now, scan.robot)
                continue
            view[region] = View.HIT
            if known is not None:
                self._hit[region, scan.robot] = now
                continue
            bearing = self._places.bearing(region, at.x, at.y)
            x, y = at.x + hit * cos(bearing), at.y + hit * sin(bearing)
            margin = BEFORE * side
            behind = hit - (far - beyond)
            before = behind < 0 and self._places.outside(region, x, y) > margin
            robot = whose(region, x, y)
            if robot is View.ROBOT and behind > margin:
                view[region] = View.FREE  # the ray has passed the middle before it hit the robot
                continue
            if robot is not None or before or self._is_past(region, now):
                view[region] = robot or (View.BEFORE if before else View.DOUBT)
                continue
            self._hit[region, scan.robot] = now
            new = self._saw(scan.robot, region, use.obstacle, scan.stamp)
            found += new
            if not new:
                view[region] = View.DOUBT
        return ScanResult(tuple(found), view)

    def _missing(
        self, robot: str, region: Region, stamp: float, now: float, source: str
    ) -> list[Sighting]:
        """Record that a sensor no longer sees the obstacle of a region."""
        self._hit.pop((region, source), None)
        if any(now - at < FRESH_SIGHT for (there, _), at in self._hit.items() if there == region):
            return []
        return self._gone(robot, region, stamp)

    def _is_past(self, region: Region, now: float) -> bool:
        """Return whether a sighting may be of an obstacle that has just been resolved."""
        return now - self._resolved.get(region, -inf) < PASSED

    def _new(self, robot: str, region: Region, stamp: float) -> bool:
        """Return whether a reading is newer than the last resolution there."""
        return stamp > self._resolved_at.get(region, {}).get(robot, -inf)

    def _saw(self, robot: str, region: Region, kind: str, stamp: float) -> list[Sighting]:
        free = self._scenario.map.is_free(region)
        if region in self._seen or not free or not self._new(robot, region, stamp):
            return []
        listed = [o for o in self._scenario.obstacles if (o.region, o.type.name) == (region, kind)]
        kinds = self._scenario.catalogue.obstacles
        self._seen[region] = listed[0] if listed else Obstacle(kinds[kind], region)
        return [Sighting(self._seen[region], True)]

    def _gone(self, robot: str, region: Region, stamp: float) -> list[Sighting]:
        young = self._new(robot, region, stamp)
        if region not in self._seen or region in self.acted_on or not young:
            return []
        return [Sighting(self._seen.pop(region), False)]

    def _nearest(
        self, scan: Scanned, at: Located, region: Region, share: float = NARROW
    ) -> float | None:
        """Return the shortest of the rays that end near the line to the centre of a region, in
        metres; None if there is none. ``share``: maximum distance from the line as a share of a
        region's side."""
        bearing = self._places.bearing(region, at.x, at.y) - at.yaw
        width = share * min(self._places.frame.resolution)
        metres_to = self._places.distance(region, at.x, at.y)
        found: float | None = None
        for index, metres in enumerate(scan.ranges):
            if isnan(metres):
                continue
            off = turned(scan.first + index * scan.step - bearing)
            far = metres if isfinite(metres) else metres_to
            if abs(off) < pi / 2 and abs(far * sin(off)) <= width:
                ahead = metres * cos(off) if isfinite(metres) else inf
                found = ahead if found is None else min(found, ahead)
        return found


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
