"""Robots with ROS 2 under rmw_cyclonedds: Nav2's NavigateToPose, odometry, scans, reports.

A robot with namespace ``/digit`` has the action ``/digit/navigate_to_pose``, the topics
``/digit/odom`` and ``/digit/scan``, the report topic, and a ``std_srvs/Trigger`` for each action.
"""

from __future__ import annotations

import time
from cmath import rect
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import atan2, cos, inf, isfinite, isnan, nan, remainder, sin, tau
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from msgspec import Struct

from safenav.fleet.file import Network, Station
from safenav.fleet.ros2 import node as ros
from safenav.fleet.ros2.node import LATCHED, RELIABLE, SENSOR, Client, Participant
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    InputHeard,
    Located,
    Message,
    Performed,
    Reported,
    Scanned,
    result_of,
)
from safenav.trace.vocabulary import ActResult

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

PERIOD = 0.05
"""Seconds between two messages."""
FRAME = "map"
"""The frame of goals and setpoints."""
JOINT = "mass"
"""The joint of trajectories: a body's centre."""


class Streams:
    """The reference streams of all followers. A thread calls ``send`` with a robot and the next
    second of its reference. A stream continues after the end of its reference, since silence means
    that safenav is dead."""

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
        """End a robot's stream. Return whether it had one."""
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


def located(robot: str, stamp: float, odometry: Any) -> Located | None:
    """Return x, y and yaw of a ``nav_msgs/Odometry``; None if one of them is not finite, since the
    estimator has diverged."""
    pose = odometry.pose.pose
    return _finite(Located(robot, stamp, *_planar(pose.position, pose.orientation)))


def _planar(place: Any, turn: Any) -> tuple[float, float, float]:
    """Return x, y and yaw of a pose with a position and a quaternion."""
    sine = 2 * (turn.w * turn.z + turn.x * turn.y)
    cosine = 1 - 2 * (turn.y * turn.y + turn.z * turn.z)
    return float(place.x), float(place.y), atan2(sine, cosine)


def _finite(at: Located) -> Located | None:
    return at if all(map(isfinite, (at.x, at.y, at.yaw))) else None


class Transforms:
    """The transforms of a robot: its pose, from ``map`` to its frame."""

    def __init__(self, robot: str, frame: str) -> None:
        self._robot, self._frame = robot, frame
        self._known: dict[str, tuple[str, float | None, tuple[float, float, float]]] = {}
        """For each frame: its parent, the stamp (None: static), and x, y, yaw in the parent."""

    def take(self, message: Any, *, static: bool) -> Located | None:
        """Store transforms. Return the robot's pose if the ``tf2_msgs/TFMessage`` renews the moving
        transform nearest to the robot, whose stamp is that of the pose; else None."""
        fresh = set()
        for each in message.transforms:
            child, parent = each.child_frame_id.strip("/"), each.header.frame_id.strip("/")
            stamp = None if static else seconds_of(each.header.stamp)
            body = each.transform
            self._known[child] = parent, stamp, _planar(body.translation, body.rotation)
            fresh.add(child)
        place, yaw = 0j, 0.0
        frame, moving, seen = self._frame, "", set[str]()
        while frame != FRAME:
            if frame in seen or frame not in self._known:
                return None
            seen.add(frame)
            parent, stamp, (east, north, turn) = self._known[frame]
            place, yaw = complex(east, north) + place * rect(1.0, turn), yaw + turn
            moving, frame = moving or (frame if stamp is not None else ""), parent
        if moving not in fresh:
            return None
        at = self._known[moving][1]
        assert at is not None
        return _finite(Located(self._robot, at, place.real, place.imag, remainder(yaw, tau)))


def seconds_of(stamp: Any) -> float:
    """Return a ``builtin_interfaces/Time`` in seconds."""
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def scanned(robot: str, stamp: float, scan: Any) -> Scanned:
    """Return a ``sensor_msgs/LaserScan`` as rays. By REP 117, ``-inf`` is a hit nearer than
    ``range_min``, and a range above ``range_max`` is a ray without a hit. A range below
    ``range_min`` or NaN is not a reading."""
    least, most = float(scan.range_min), float(scan.range_max)

    def metres(measured: float) -> float:
        if measured == -inf:
            return least
        return nan if isnan(measured) or measured < least else measured if measured <= most else inf

    ranges = [metres(float(measured)) for measured in scan.ranges]
    return Scanned(robot, stamp, float(scan.angle_min), float(scan.angle_increment), ranges)


def facing(yaw: float | None) -> tuple[float, float]:
    """Return z and w of the quaternion of a yaw in radians (None: 0)."""
    half = (yaw or 0.0) / 2
    return sin(half), cos(half)


ACTION, NAVIGATE = "navigate_to_pose", "nav2_msgs/action/NavigateToPose"

_ENDS = {
    ros.SUCCEEDED: GoalEnd.SUCCEEDED,
    ros.CANCELED: GoalEnd.CANCELED,
    ros.ABORTED: GoalEnd.ABORTED,
}


class _Sent(Struct):
    """A goal that the action's services are processing."""

    number: int
    uuid: Any
    canceling: bool = False


class _Robot:
    """The clients of one robot. The threads of the mission and of cyclonedds call its methods."""

    def __init__(
        self, name: str, station: Station, node: Participant, post: Callable[[Message], None]
    ) -> None:
        self._name = name
        self._post = post
        self._lock = Lock()
        self._current: _Sent | None = None
        action = station.path(f"{ACTION}/_action")
        self._send = Client(node, f"{action}/send_goal", f"{NAVIGATE}_SendGoal")
        self._result = Client(node, f"{action}/get_result", f"{NAVIGATE}_GetResult")
        self._cancel = Client(node, f"{action}/cancel_goal", "action_msgs/srv/CancelGoal")
        self._acts = {
            service: Client(node, station.path(service), "std_srvs/srv/Trigger")
            for service in dict.fromkeys(station.act.values())
        }

    # Goals

    @property
    def connected(self) -> bool:
        return self._send.connected and self._result.connected

    @property
    def foreign(self) -> str:
        """The middleware of the robot's action server, if it is not Cyclone DDS."""
        return self._send.foreign or self._result.foreign

    def navigate(self, goal: GoalPoint) -> None:
        with self._lock:
            self._current = sent = _Sent(goal.number, ros.UUID(list(uuid4().bytes)))
            take = partial(self._answered, sent)
            self._send.call(take, goal_id=sent.uuid, goal=_navigate(goal))

    def cancel(self) -> None:
        with self._lock:
            if self._current is not None:
                self._current.canceling = True
                self._stop(self._current)

    def _stop(self, sent: _Sent) -> None:
        """Cancel a goal. Ignore the reply, since the goal's result shows whether it ended."""
        self._cancel.call(lambda _: None, goal_info=ros.GoalInfo(sent.uuid, ros.Time()))

    def _answered(self, sent: _Sent, reply: Any) -> None:
        if not reply.accepted:
            self._end(sent, GoalEnd.REJECTED, "goal rejected")
            return
        with self._lock:
            self._result.call(partial(self._ended, sent), goal_id=sent.uuid)
            if sent.canceling:  # cancelled before the server accepted the goal
                self._stop(sent)

    def _ended(self, sent: _Sent, reply: Any) -> None:
        code = int(reply.result.error_code)
        reason = f"Nav2's error code {code}" if code else ""
        self._end(sent, _ENDS.get(int(reply.status), GoalEnd.ABORTED), reason)

    def _end(self, sent: _Sent, end: GoalEnd, reason: str) -> None:
        with self._lock:
            if self._current is sent:
                self._current = None
        self._post(GoalEnded(self._name, sent.number, end, reason))

    # Actions

    def perform(self, service: str, number: int) -> None:
        client = self._acts[service]
        if client.connected:
            client.call(partial(self._performed, number))
            return
        why = f"no server of {service}"
        if client.foreign:
            why += f" with Cyclone DDS, but one with {client.foreign}"
        self._post(Performed(self._name, number, ActResult.FAILED, why))

    def _performed(self, number: int, reply: Any) -> None:
        result, text = result_of(bool(reply.success), str(reply.message)), str(reply.message)
        self._post(Performed(self._name, number, result, text))


class Ros2Transport:
    """A fleet on one ROS 2 domain. A process may use one at a time."""

    now = staticmethod(time.monotonic)
    step = None

    def __init__(
        self, network: Network, stations: Mapping[str, Station], inputs: Mapping[str, str]
    ) -> None:
        self._network, self._stations, self._inputs = network, stations, inputs
        self._post: Callable[[Message], None]  # from ``open`` on
        self._streams = Streams(self._send)
        self._lock = Lock()
        self._robots: dict[str, _Robot] = {}
        self._references: dict[str, Any] = {}
        self._node: Participant | None = None

    def open(self, post: Callable[[Message], None]) -> None:
        network, self._post = self._network, post
        self._node = node = Participant(network.domain, network.interface, network.peers)
        for name, station in self._stations.items():
            self._robots[name] = _Robot(name, station, node, post)
            if station.follow is not None:
                topic = _topic(station.path(station.follow.topic))
                self._references[name] = node.writer(topic, ros.TRAJECTORY, RELIABLE)
        for topic, kind, quality, take in self._topics():
            node.listen(_topic(topic), kind, take, quality)

    def missing(self) -> list[str]:
        found = []
        for name, station in self._stations.items():
            if not self._answers(name):
                topic = station.path(ACTION if station.follow is None else station.follow.topic)
                other = self._robots[name].foreign
                found.append(topic + f" (a server of {other}, not of Cyclone DDS)" * bool(other))
        return found

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        if self._answers(robot):
            self._robots[robot].navigate(goal)
        else:
            self._post(GoalEnded(robot, goal.number, GoalEnd.UNREACHABLE, "no action server"))

    def follow(self, robot: str, reference: Setpoints) -> None:
        self._streams.follow(robot, reference)

    def cancel(self, robot: str) -> None:
        if not self._streams.stop(robot):
            self._robots[robot].cancel()

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        del obstacle  # std_srvs/Trigger has no fields: the service knows its obstacle
        self._robots[robot].perform(action, number)

    def close(self) -> None:
        self._streams.close()
        for robot in self._robots.values():
            robot.cancel()
        if self._node is not None:
            self._node.close()
        self._robots, self._references, self._node = {}, {}, None

    def _topics(self) -> Iterator[tuple[str, str, Any, Callable[[Any], None]]]:
        """Yield the topics to subscribe to: name, type, quality of service, message handler."""
        for name, topic in self._inputs.items():
            yield topic, "std_msgs/Bool", RELIABLE, partial(self._heard, InputHeard, name)
        for name, station in self._stations.items():
            if station.tf is None:
                odometry = partial(self._stamped, located, name)
                yield station.pose_topic, "nav_msgs/Odometry", SENSOR, odometry
            else:
                frames = Transforms(name, station.tf.frame.strip("/"))
                for ending, quality in (("", RELIABLE), ("_static", LATCHED)):
                    take = partial(self._transformed, frames, static=bool(ending))
                    yield station.pose_topic + ending, "tf2_msgs/TFMessage", quality, take
            if station.scan is not None:
                scan = partial(self._stamped, scanned, name)
                yield station.path(station.scan.topic), "sensor_msgs/LaserScan", SENSOR, scan
            if station.report is not None:
                report = partial(self._heard, Reported, name)
                yield station.path(station.report), "std_msgs/String", RELIABLE, report

    def _heard(self, meaning: Callable[[str, Any], Message], name: str, message: Any) -> None:
        """Pass on a robot's text report or an input's value."""
        data = message.data
        self._post(meaning(name, data.strip() if isinstance(data, str) else data))

    def _stamped(
        self, meaning: Callable[[str, float, Any], Message | None], name: str, message: Any
    ) -> None:
        """Pass on a measurement of a robot if it is valid."""
        found = meaning(name, seconds_of(message.header.stamp), message)
        if found is not None:
            self._post(found)

    def _transformed(self, frames: Transforms, message: Any, *, static: bool) -> None:
        with self._lock:  # each of a robot's two topics has a thread
            found = frames.take(message, static=static)
        if found is not None:
            self._post(found)

    def _answers(self, robot: str) -> bool:
        """Return whether a robot's action server is available or, for a follower, whether the robot
        has subscribed to its references."""
        reference = self._references.get(robot)
        if reference is not None:
            return bool(reference.get_matched_subscriptions())
        return self._robots[robot].connected

    def _send(self, robot: str, part: Setpoints) -> None:
        """Send a robot the next second of its reference."""
        header = ros.MessageHeader(_whole(ros.Time, time.time()), FRAME)
        points = [_point(k * part.step, row) for k, row in enumerate(part.rows.tolist())]
        self._references[robot].write(ros.Trajectory(header, [JOINT], points))


def _point(after: float, row: Sequence[float]) -> Any:
    """Return a point of a ``trajectory_msgs/MultiDOFJointTrajectory``: pose, velocity and
    acceleration of a body."""
    turn, still = ros.Quaternion(0.0, 0.0, *facing(row[9])), ros.Vector3(0.0, 0.0, 0.0)
    place, *rates = (ros.Vector3(*row[i : i + 3]) for i in (0, 3, 6))
    twists = ([ros.Twist(of, still)] for of in rates)
    when = _whole(ros.Duration, after)
    return ros.MultiDOFJointTrajectoryPoint([ros.Transform(place, turn)], *twists, when)


def _topic(name: str) -> str:
    """Return the name of a topic on the wire."""
    return f"rt/{name.lstrip('/')}"


def _whole(kind: Any, seconds: float) -> Any:
    """Return seconds as a ROS 2 time or duration, with whole nanoseconds."""
    return kind(int(seconds), int(seconds % 1 * 1e9))


def _navigate(goal: GoalPoint) -> Any:
    turn = ros.Quaternion(0.0, 0.0, *facing(goal.yaw))
    pose = ros.PlacedPose(ros.Point(goal.x, goal.y, 0.0), turn)
    header = ros.MessageHeader(ros.Time(), FRAME)
    return ros.NavigateGoal(ros.PoseStamped(header, pose), "")
