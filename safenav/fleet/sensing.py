"""Obstacles that a fleet has detected: lidar rays and reports mapped to regions. All robots share
their sightings. A reading from before the resolution of an obstacle does not restore it; only
stamps of the same robot are compared.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import cos, hypot, inf, isfinite, isnan, pi, sin

from safenav.fleet.file import ScanUse
from safenav.fleet.robots import PASSED, STALE, DrivenRobot, View
from safenav.fleet.transport import Located, Places, Reported, Scanned, turned
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.acts import lost
from safenav.world.map import Region

FRESH_SIGHT = 2.0
"""Seconds for which a sighting by one sensor outweighs a miss by another: a door leaf is thin
edge-on, and messages may be late."""
BEFORE = 0.1
"""Minimum distance of a ray's end, as a share of a region's side: before the region to count as
before it; past the centre to count as behind it."""
BEHIND = 0.35
"""Maximum distance of a ray's end behind a region's centre, as a share of its side, for an obstacle
there; behind half a side it hits the wall of the next region."""
NARROW, WIDE = 0.1, 0.3
"""Maximum distances of rays from the line to a region's centre, as shares of its side: NARROW to
detect an obstacle, WIDE to detect its absence, since an open door's leaves are beside the
centre."""


class Sensing:
    """The obstacles known to be present, by region, and robots in regions to which they were not
    sent. ``tell`` takes each sighting: an obstacle, the robot that sees it (if any), and whether it
    is present."""

    def __init__(
        self,
        scenario: Scenario,
        places: Places,
        bodies: Mapping[str, DrivenRobot],
        tell: Callable[[Obstacle, str | None, bool], None],
    ) -> None:
        self._scenario, self._places, self._bodies, self._tell = scenario, places, bodies, tell
        self._side = places.frame.resolution
        self._strays: dict[str, Obstacle] = {}
        self._seen: dict[Region, Obstacle] = {}
        self._resolved_at: dict[Region, dict[str, float]] = {}
        self._resolved: dict[Region, float] = {}
        self._hit: dict[tuple[Region, str], float] = {}
        """The time at which each sensor last detected the obstacle of a region."""
        self.acted_on: set[Region] = set()
        """Regions with an obstacle on which a robot acts. The result of the action shows whether it
        is gone."""

    def at(self, region: Region) -> Obstacle | None:
        return self._seen.get(region)

    def seen(self) -> Iterable[Obstacle]:
        """Return the obstacles known to be present."""
        return self._seen.values()

    def forget(self, region: Region, stamps: Mapping[str, float], now: float) -> None:
        """Discard a resolved obstacle. ``stamps``: the stamp of each robot's newest odometry."""
        self._seen.pop(region, None)
        self._hit = {key: at for key, at in self._hit.items() if key[0] != region}
        self._resolved_at[region] = dict(stamps)
        self._resolved[region] = now

    def report(self, message: Reported, stamp: float, now: float) -> None:
        """Process a report, ``door@47`` or ``-door@47``. Ignore any other text."""
        there = not message.text.startswith("-")
        kind, _, place = message.text.removeprefix("-").strip().partition("@")
        region = self._scenario.map.names.get(place)
        if region is None and place.isdecimal() and len(place) < 10:
            region = int(place)
        source = f"report of {message.robot}"
        if region is None or kind not in self._scenario.catalogue.obstacles:
            return
        if not there:
            self._missing(message.robot, region, stamp, now, source)
        elif not self._is_past(region, now):
            self._hit[region, source] = now
            self._saw(message.robot, region, kind, stamp)

    def off(self, body: DrivenRobot) -> float:
        """Return a robot's distance (metres) from the regions that it should occupy; 0 inside."""
        at = body.place
        assert at is not None
        return min(self._places.outside(region, at.x, at.y) for region in body.regions)

    def is_astray(self, body: DrivenRobot) -> bool:
        return self.off(body) > body.station.tolerance

    def stray(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return an obstacle that represents another robot in a region to which it was not sent: it
        has left its path or a person has moved it. None if there is none."""
        for body in self._bodies.values():
            at = body.place
            if at is None or not robot.conflicts(body.robot):
                continue
            if self.is_astray(body) and self._places.region(at.x, at.y) == region:
                team = self._scenario.robots
                rivals = [o.name for o in team if o.conflicts(body.robot)]
                found = lost(body.robot, frozenset(rivals), region)
                return self._strays.setdefault(body.robot.name, found)
        return None

    def stray_left(self, body: DrivenRobot) -> None:
        """Report the end of the obstacle that represents this robot once the robot has left."""
        at, found = body.place, self._strays.get(body.robot.name)
        if found and at and self._places.region(at.x, at.y) != found.region:
            self._tell(self._strays.pop(body.robot.name), None, False)

    def placed(self, robot: str) -> None:
        """Record that an operator has placed a robot where the team expects it."""
        self._strays.pop(robot, None)

    def is_shared(self, body: DrivenRobot, region: Region) -> bool:
        """Return whether a region also contains a robot without a conflict with this one, such as a
        flyer above it."""
        return any(
            region in other.regions and not body.robot.conflicts(other.robot)
            for other in self._bodies.values()
            if other is not body
        )

    def keep(self, body: DrivenRobot, scan: Scanned, heard: float) -> None:
        """Store a scan until odometry shows its pose, since either may be late."""
        if body.station.scan is None or scan.stamp <= body.newest:
            return
        body.newest = scan.stamp
        body.unread.append((heard, scan))

    def read(self, body: DrivenRobot, now: float) -> Iterator[None]:
        """Evaluate the scans whose poses are now known from odometry. Scans at rest, at the robot's
        present pose, update its view. Yield after each of these."""
        while body.unread and body.place is not None:
            heard, scan = body.unread[0]
            if now - heard <= STALE and scan.stamp > body.place.stamp:
                return
            body.unread.popleft()
            use, here, at = body.station.scan, body.stands, body.stood(scan.stamp)
            fresh = now - heard <= STALE and scan.stamp > max(body.looked, body.arrived)
            if use is None or here is None or at is None or not fresh:
                continue
            if self._places.region(at.x, at.y) != here:
                continue
            body.looked, body.viewed = scan.stamp, heard
            body.view = {
                region: self._view(body, use, scan, at, region, heard)
                for region in self._scenario.map.neighbours(here)
            }
            yield

    def _view(
        self,
        body: DrivenRobot,
        use: ScanUse,
        scan: Scanned,
        at: Located,
        region: Region,
        heard: float,
    ) -> View:
        """Return the result of a scan for an adjacent region, and report whether it shows an
        obstacle. Do not report an obstacle as gone while another sensor detects it."""
        hit, known = self._nearest(scan, at, region), self._seen.get(region)
        if hit is None:
            return View.SEEN
        middle = self._places.distance(region, at.x, at.y)
        far = middle + BEHIND * self._side
        if hit > far:
            wide = self._nearest(scan, at, region, WIDE)
            ajar = wide is not None and wide <= far
            if known is not None and known.type.name == use.obstacle.name and not ajar:
                self._missing(scan.robot, region, scan.stamp, heard, scan.robot)
            return View.SEEN
        if known is not None:
            self._hit[region, scan.robot] = heard
            return View.SEEN
        bearing = self._places.bearing(region, at.x, at.y)
        x, y = at.x + hit * cos(bearing), at.y + hit * sin(bearing)
        margin = BEFORE * self._side
        robot = self._whose(body, heard, region, x, y)
        if robot is View.ROBOT and hit - middle > margin:
            return View.SEEN  # the ray passed the centre before it hit the robot
        if robot is not None:
            return robot
        if hit < middle and self._places.outside(region, x, y) > margin:
            return View.BEFORE
        if self._is_past(region, heard):
            return View.DOUBT
        self._hit[region, scan.robot] = heard
        new = self._saw(scan.robot, region, use.obstacle.name, scan.stamp)
        return View.SEEN if new else View.DOUBT

    def _missing(self, robot: str, region: Region, stamp: float, now: float, source: str) -> None:
        """Record that a sensor no longer sees the obstacle in a region."""
        self._hit.pop((region, source), None)
        others = (at for (there, _), at in self._hit.items() if there == region)
        held = region in self.acted_on or any(now - at < FRESH_SIGHT for at in others)
        if region in self._seen and not held and self._new(robot, region, stamp):
            self._tell(self._seen.pop(region), robot, False)

    def _is_past(self, region: Region, now: float) -> bool:
        """Return whether a sighting may show a just resolved obstacle."""
        return now - self._resolved.get(region, -inf) < PASSED

    def _new(self, robot: str, region: Region, stamp: float) -> bool:
        """Return whether a robot's reading is newer than the last resolution in a region."""
        return stamp > self._resolved_at.get(region, {}).get(robot, -inf)

    def _saw(self, robot: str, region: Region, kind: str, stamp: float) -> bool:
        """Record that a sensor sees an obstacle. Return whether the obstacle was unknown."""
        free = self._scenario.map.is_free(region)
        if region in self._seen or not free or not self._new(robot, region, stamp):
            return False
        listed = [o for o in self._scenario.obstacles if (o.region, o.type.name) == (region, kind)]
        kinds = self._scenario.catalogue.obstacles
        self._seen[region] = listed[0] if listed else Obstacle(kinds[kind], region)
        self._tell(self._seen[region], robot, True)
        return True

    def _nearest(
        self, scan: Scanned, at: Located, region: Region, share: float = NARROW
    ) -> float | None:
        """Return the length in metres of the shortest ray that ends near the line to a region's
        centre; None if there is none. ``share``: the maximum distance from the line as a share of a
        region's side."""
        bearing = self._places.bearing(region, at.x, at.y) - at.yaw
        width = share * self._side
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

    def _whose(
        self, body: DrivenRobot, heard: float, region: Region, x: float, y: float
    ) -> View | None:
        """Return ROBOT if a ray that ended in a region at a point (metres) may have hit another
        robot: one is near the point or occupies the region. Return DOUBT if one was near the point
        or in the region up to ``PASSED`` seconds before the scan was received; else None."""
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
        """Return whether the body of a robot at ``place`` may touch the point (x, y)."""
        size = body.robot.model.size
        half = self._side / 2
        reach = half if size is None else size / 2
        return place is not None and hypot(place.x - x, place.y - y) < reach + half
