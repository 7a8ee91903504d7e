"""Conversion between regions and metres, headings and yaw.

x, y in metres in the frame of the map (map_server's: x east, y north, ``origin`` its south-western
corner); yaw in radians, counter-clockwise from the x axis.
"""

from __future__ import annotations

from math import atan2, floor, hypot, pi

from msgspec import Struct

from safenav.pace.robot import YAW
from safenav.world.map import Frame, Heading, Region, RegionMap
from safenav.world.poses import Pose


class Places(Struct, frozen=True):
    """The regions of a map in metres."""

    world: RegionMap
    frame: Frame

    def centre(self, region: Region) -> tuple[float, float]:
        """Return x and y of the centre of a region."""
        return self.frame.centre(*self.world.position(region), self.world.rows)

    def yaw(self, pose: Pose) -> float | None:
        """Return the direction that a robot faces; None for a robot without a heading."""
        return None if pose.heading is None else YAW[pose.heading.label] + self.frame.yaw

    def region(self, x: float, y: float) -> Region | None:
        """Return the region that contains a point; None off the map."""
        east, north = self.frame.on_map(x, y)
        col = floor(east / self.frame.resolution[0])
        row = self.world.rows - 1 - floor(north / self.frame.resolution[1])
        inside = 0 <= row < self.world.rows and 0 <= col < self.world.cols
        return self.world.region(row, col) if inside else None

    def heading(self, yaw: float) -> Heading:
        """Return the heading nearest to a direction."""
        facing = yaw - self.frame.yaw
        return min(Heading, key=lambda heading: abs(turned(YAW[heading.label] - facing)))

    def distance(self, region: Region, x: float, y: float) -> float:
        """Return the distance in metres from a point to the centre of a region."""
        cx, cy = self.centre(region)
        return hypot(cx - x, cy - y)

    def outside(self, region: Region, x: float, y: float) -> float:
        """Return the distance in metres from a point to a region; 0 inside it."""
        east, north = self.frame.on_map(x, y)
        at = self.frame.on_map(*self.centre(region))
        wide, high = self.frame.resolution
        return hypot(
            max(0.0, abs(east - at[0]) - wide / 2), max(0.0, abs(north - at[1]) - high / 2)
        )

    def bearing(self, region: Region, x: float, y: float) -> float:
        """Return the direction from a point to the centre of a region."""
        cx, cy = self.centre(region)
        return atan2(cy - y, cx - x)


def turned(angle: float) -> float:
    """Return an angle normalized to -pi to pi."""
    return (angle + pi) % (2 * pi) - pi
