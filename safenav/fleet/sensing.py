"""Obstacles that a fleet has seen: from lidar rays and reports to regions.

What one robot has seen, all know. A reading that was taken before an obstacle was resolved does not
bring it back: stamps of one robot are compared with each other only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import cos, inf, isfinite, pi, sin

from msgspec import Struct

from safenav.fleet.fleet_file import ScanUse
from safenav.fleet.place import Places, turned
from safenav.fleet.transport import Located, Reported, Scanned
from safenav.scenario.model import Obstacle, Scenario
from safenav.world.map import Region

FRESH_SIGHT = 2.0
"""Seconds for which what one robot's lidar has hit outweighs another one's that finds nothing: a
leaf seen from its edge is thin."""
PASSED = 2.0
"""Seconds for which a ray may have hit a robot that has left since: a scan may be as late as
odometry may be old."""


class Sighting(Struct, frozen=True):
    """An obstacle that is there, or is no longer there."""

    obstacle: Obstacle
    there: bool


class ScanResult(Struct, frozen=True):
    """The meaning of one scan. ``sure``: no ray may have hit a robot that has left since."""

    found: tuple[Sighting, ...]
    sure: bool


class Sensing:
    """The obstacles that are known to stand somewhere now, by region."""

    def __init__(self, scenario: Scenario, places: Places) -> None:
        self._scenario = scenario
        self._places = places
        self._seen: dict[Region, Obstacle] = {}
        self._resolved_at: dict[Region, Mapping[str, float]] = {}
        self._hit: dict[tuple[Region, str], float] = {}
        """When the lidar of a robot last hit what stands in a region."""
        self.acted_on: set[Region] = set()
        """Regions whose obstacle a robot acts on: its result tells whether it is gone."""

    def at(self, region: Region) -> Obstacle | None:
        return self._seen.get(region)

    def forget(self, region: Region, stamps: Mapping[str, float]) -> None:
        """An obstacle is resolved. ``stamps``: of each robot's newest odometry."""
        self._seen.pop(region, None)
        self._hit = {key: at for key, at in self._hit.items() if key[0] != region}
        self._resolved_at[region] = stamps

    def report(self, message: Reported, stamp: float) -> list[Sighting]:
        """Take ``door@47`` or ``-door@47``; any other text is ignored."""
        there = not message.text.startswith("-")
        kind, _, place = message.text.removeprefix("-").strip().partition("@")
        region = self._scenario.map.names.get(place)
        if region is None and place.isdecimal() and len(place) < 10:
            region = int(place)
        if region is None or kind not in self._scenario.catalogue.obstacles:
            return []
        if there:
            return self._saw(message.robot, region, kind, stamp)
        return self._gone(message.robot, region, stamp)

    def scan(
        self,
        use: ScanUse,
        scan: Scanned,
        at: Located,
        here: Region,
        busy: Callable[[Region], bool],
        left: Callable[[Region], bool],
        now: float,
    ) -> ScanResult:
        """Look into the regions beside ``here`` by a scan taken at ``at`` and heard at ``now``, in
        seconds. ``busy``: whether a ray into a region may have hit another robot that is there;
        ``left``: or one that was there when the scan was taken. An obstacle that another robot's
        lidar still hits is not gone."""
        found: list[Sighting] = []
        sure = True
        for region in self._scenario.map.neighbours(here):
            hit = self._nearest(scan, at, region)
            if hit is None or busy(region):
                continue
            known = self._seen.get(region)
            if hit <= self._places.distance(region, at.x, at.y) + use.beyond:
                if left(region):
                    sure = False
                    continue
                self._hit[region, scan.robot] = now
                found += self._saw(scan.robot, region, use.obstacle, scan.stamp)
            elif known is not None and known.type.name == use.obstacle:
                self._hit.pop((region, scan.robot), None)
                if not self._is_hit(region, now):
                    found += self._gone(scan.robot, region, scan.stamp)
        return ScanResult(tuple(found), sure)

    def _is_hit(self, region: Region, now: float) -> bool:
        return any(
            now - at < FRESH_SIGHT for (there, _), at in self._hit.items() if there == region
        )

    def _new(self, robot: str, region: Region, stamp: float) -> bool:
        """Whether a reading is younger than the last resolution there."""
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

    def _nearest(self, scan: Scanned, at: Located, region: Region) -> float | None:
        """The shortest of the rays that end near the line to the middle of a region, in metres;
        None if none goes there."""
        bearing = self._places.bearing(region, at.x, at.y) - at.yaw
        width = 0.1 * min(self._places.frame.resolution)
        metres_to = self._places.distance(region, at.x, at.y)
        found: float | None = None
        for index, metres in enumerate(scan.ranges):
            off = turned(scan.first + index * scan.step - bearing)
            far = metres if isfinite(metres) else metres_to
            if abs(off) < pi / 2 and abs(far * sin(off)) <= width:
                ahead = metres * cos(off) if isfinite(metres) else inf
                found = ahead if found is None else min(found, ahead)
        return found
