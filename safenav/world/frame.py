"""Frame of a map in metres, as in ROS map_server: x grows east, y grows north, and the
origin is the pose of the south-western (lower left) corner of the map."""

from __future__ import annotations

from math import cos, sin

from msgspec import Struct


class Frame(Struct, frozen=True):
    """``resolution``: metres of a region from west to east and from south to north; ``origin``: x
    and y of the map's south-western corner in metres; ``yaw``: rotation of the map about that
    corner, counterclockwise, in radians."""

    resolution: tuple[float, float]
    origin: tuple[float, float] = (0.0, 0.0)
    yaw: float = 0.0

    def centre(self, row: float, col: float, rows: int) -> tuple[float, float]:
        """x and y in metres of the centre of a region, on a map with this many rows; with a
        fractional ``row`` or ``col``, of a point between regions."""
        east = (col + 0.5) * self.resolution[0]
        north = (rows - row - 0.5) * self.resolution[1]
        x = self.origin[0] + east * cos(self.yaw) - north * sin(self.yaw)
        y = self.origin[1] + east * sin(self.yaw) + north * cos(self.yaw)
        return x, y

    def on_map(self, x: float, y: float) -> tuple[float, float]:
        """Metres east and north of the map's south-western corner, along its sides."""
        dx, dy = x - self.origin[0], y - self.origin[1]
        east = dx * cos(self.yaw) + dy * sin(self.yaw)
        return east, dy * cos(self.yaw) - dx * sin(self.yaw)
