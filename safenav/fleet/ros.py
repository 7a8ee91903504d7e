"""Messages that ROS 1 and ROS 2 have in common, field by field: what they mean to the fleet.

Classes of both have the same fields but for their stamps, so those come as seconds.
"""

from __future__ import annotations

from math import atan2, cos, inf, sin
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from safenav.fleet.transport import Located, Scanned

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

FRAME = "map"
"""The frame of goals and setpoints."""
MASS, LEFT, RIGHT = "mass", "left_foot", "right_foot"
"""The joints of trajectories: the middle of a body or a walker's centre of mass; its feet."""
STEPS = "_steps"
"""The topic of footsteps is that of the reference with this ending."""

Pose = tuple[float, float, float, float]
"""x, y, z, yaw."""


class TrajectoryFrame(Struct, frozen=True):
    """A point of a trajectory: seconds from its stamp, a pose for each joint; velocity and
    acceleration (x, y, z) of the only joint, or none."""

    after: float
    poses: tuple[Pose, ...]
    velocity: tuple[float, ...] = ()
    acceleration: tuple[float, ...] = ()


def ahead_of(part: Setpoints) -> list[TrajectoryFrame]:
    """The next second of a reference, sample by sample."""
    return [
        TrajectoryFrame(k * part.step, ((row[0], row[1], row[2], row[9]),), row[3:6], row[6:9])
        for k, row in enumerate(map(tuple, part.rows.tolist()))
    ]


def steps_of(part: Setpoints) -> list[TrajectoryFrame]:
    """The next footsteps of a walker: both feet as they stand from each landing on, the first one
    now. A foot in the air is where it last stood."""
    standing: dict[int, Pose] = {}
    found: list[TrajectoryFrame] = []
    for foot in part.feet:
        standing[foot.side] = (foot.x, foot.y, 0.0, foot.yaw)
        if len(standing) == 2:
            after = max(0.0, foot.down - part.begin)
            found = [one for one in found if one.after < after]
            found.append(TrajectoryFrame(after, (standing[1], standing[-1])))
    return found


def located(robot: str, stamp: float, odometry: Any) -> Located:
    """A ``nav_msgs/Odometry``: x, y and the yaw of its quaternion."""
    pose = odometry.pose.pose
    q = pose.orientation
    yaw = atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
    return Located(robot, stamp, float(pose.position.x), float(pose.position.y), yaw)


def scanned(robot: str, stamp: float, scan: Any) -> Scanned:
    """A ``sensor_msgs/LaserScan``; a range outside its limits is one that hit nothing."""
    least, most = float(scan.range_min), float(scan.range_max)
    ranges = [float(r) if least <= r <= most else inf for r in scan.ranges]
    return Scanned(robot, stamp, float(scan.angle_min), float(scan.angle_increment), ranges)


def facing(yaw: float | None) -> tuple[float, float]:
    """The quaternion's z and w of a turn about the vertical (radians); upright for None."""
    half = (yaw or 0.0) / 2
    return sin(half), cos(half)
