"""Reference streams, and the meaning of messages in metres and seconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from math import atan2, cos, inf, isfinite, isnan, nan, remainder, sin, tau
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Any

from safenav.fleet.transport import Located, Scanned

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

PERIOD = 0.05
"""Seconds between two messages."""


FRAME = "map"
"""The frame of goals and setpoints."""
Joints = tuple[str, ...]
BODY, FEET = ("mass",), ("left_foot", "right_foot")
"""The joints of trajectories: the middle of a body or a walker's centre of mass; its feet."""
TOPICS: Mapping[Joints, str] = {BODY: "", FEET: "_steps"}
"""Suffixes of their topics, appended to the topic of the reference."""

Pose = tuple[float, float, float, float]
"""x, y, z, yaw."""


class Streams:
    """The reference streams of all followers. A thread calls ``send`` with a robot and the next
    second of its reference. A stream continues after the end of its reference, since silence means
    that safenav has died."""

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
        """End the stream of a robot; return whether it had one."""
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


def steps_of(part: Setpoints) -> list[tuple[float, tuple[Pose, Pose]]]:
    """Return the next footsteps of a walker: seconds from now, and the poses of both feet after
    each landing, beginning with the present ones. A foot in the air counts where it last stood."""
    standing: dict[int, Pose] = {}
    found: list[tuple[float, tuple[Pose, Pose]]] = []
    for foot in part.feet:
        standing[foot.side] = (foot.x, foot.y, 0.0, foot.yaw)
        if len(standing) == 2:
            after = max(0.0, foot.down - part.begin)
            found = [one for one in found if one[0] < after]
            found.append((after, (standing[1], standing[-1])))
    return found


def located(robot: str, stamp: float, odometry: Any) -> Located | None:
    """Return x, y and yaw of a ``nav_msgs/Odometry``; None if one of them is not finite, because
    the estimator has diverged."""
    pose = odometry.pose.pose
    return _finite(Located(robot, stamp, *_planar(pose.position, pose.orientation)))


def _planar(place: Any, turn: Any) -> tuple[float, float, float]:
    """Return x, y and yaw of a position and a quaternion."""
    sine = 2 * (turn.w * turn.z + turn.x * turn.y)
    cosine = 1 - 2 * (turn.y * turn.y + turn.z * turn.z)
    return float(place.x), float(place.y), atan2(sine, cosine)


def _finite(at: Located) -> Located | None:
    return at if all(map(isfinite, (at.x, at.y, at.yaw))) else None


class Transforms:
    """The transforms of one robot: its pose, from ``map`` to its frame."""

    def __init__(self, robot: str, frame: str) -> None:
        self._robot, self._frame = robot, frame
        self._known: dict[str, tuple[str, float | None, tuple[float, float, float]]] = {}
        """By frame: its parent, the stamp (None: static), and x, y, yaw in its parent."""

    def take(self, message: Any, *, static: bool) -> Located | None:
        """Take a ``tf2_msgs/TFMessage``; return the pose, if its newest part has changed: with the
        stamp of the transform next to the robot, which moves with it."""
        fresh = set()
        for each in message.transforms:
            child, parent = each.child_frame_id.strip("/"), each.header.frame_id.strip("/")
            stamp = None if static else seconds_of(each.header.stamp)
            body = each.transform
            self._known[child] = parent, stamp, _planar(body.translation, body.rotation)
            fresh.add(child)
        x = y = yaw = 0.0
        frame, moving, seen = self._frame, "", set[str]()
        while frame != FRAME:
            if frame in seen or frame not in self._known:
                return None
            seen.add(frame)
            parent, stamp, (east, north, turn) = self._known[frame]
            x, y = (
                east + x * cos(turn) - y * sin(turn),
                north + x * sin(turn) + y * cos(turn),
            )
            yaw += turn
            moving, frame = moving or (frame if stamp is not None else ""), parent
        if moving not in fresh:
            return None
        at = self._known[moving][1]
        assert at is not None
        return _finite(Located(self._robot, at, x, y, remainder(yaw, tau)))


def seconds_of(stamp: Any) -> float:
    """Return a ``builtin_interfaces/Time`` in seconds."""
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def scanned(robot: str, stamp: float, scan: Any) -> Scanned:
    """Return a ``sensor_msgs/LaserScan`` as rays. By REP 117, ``-inf`` is a hit nearer than
    ``range_min``, and a range above ``range_max`` hits nothing; a range below ``range_min`` is not
    a reading, nor is NaN."""
    least, most = float(scan.range_min), float(scan.range_max)

    def metres(measured: float) -> float:
        if measured == -inf:
            return least
        return nan if isnan(measured) or measured < least else measured if measured <= most else inf

    ranges = [metres(float(measured)) for measured in scan.ranges]
    return Scanned(robot, stamp, float(scan.angle_min), float(scan.angle_increment), ranges)


def facing(yaw: float | None) -> tuple[float, float]:
    """Return z and w of the quaternion of a yaw in radians; None counts as 0."""
    half = (yaw or 0.0) / 2
    return sin(half), cos(half)
