"""Shared by the transports of ROS 1 and ROS 2: the meaning of messages, streams of references.

Classes of both have the same fields but for their stamps, so those come as seconds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from math import atan2, cos, inf, isnan, nan, sin
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from safenav.fleet.transport import Located, Scanned

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

PERIOD = 0.05
"""Seconds between two messages."""


class Streams:
    """The references of all robots that follow; ``send`` gets what is ahead, in a thread. A stream
    continues after the end of its reference: its silence tells a robot that safenav has died."""

    def __init__(self, send: Callable[[str, Setpoints], None]) -> None:
        self._send = send
        self._references: dict[str, Setpoints] = {}
        self._lock = Lock()
        self._end = Event()
        self._thread: Thread | None = None

    def follow(self, robot: str, reference: Setpoints) -> None:
        """Stream this reference from now on. Its times are those of ``time.monotonic``."""
        with self._lock:
            self._references[robot] = reference
            if self._thread is None:
                self._thread = Thread(target=self._run, daemon=True)
                self._thread.start()

    def stop(self, robot: str) -> bool:
        """End the stream of a robot; whether it had one."""
        with self._lock:
            return self._references.pop(robot, None) is not None

    def close(self) -> None:
        self._end.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        due = time.monotonic()
        while not self._end.wait(max(0.0, due - time.monotonic())):
            with self._lock:
                now = list(self._references.items())
            for robot, reference in now:
                self._send(robot, reference.ahead(time.monotonic()))
            due = max(due + PERIOD, time.monotonic())


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
    """A ``sensor_msgs/LaserScan``. As in REP 117, ``-inf`` is a hit nearer than ``range_min``, and
    a range above ``range_max`` hit nothing; one below ``range_min`` says nothing, nor does NaN."""
    least, most = float(scan.range_min), float(scan.range_max)

    def metres(told: float) -> float:
        if told == -inf:
            return least
        return nan if isnan(told) or told < least else told if told <= most else inf

    ranges = [metres(float(told)) for told in scan.ranges]
    return Scanned(robot, stamp, float(scan.angle_min), float(scan.angle_increment), ranges)


def facing(yaw: float | None) -> tuple[float, float]:
    """The quaternion's z and w of a turn about the vertical (radians); upright for None."""
    half = (yaw or 0.0) / 2
    return sin(half), cos(half)
