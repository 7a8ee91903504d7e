"""Robots with ROS 2 under rmw_cyclonedds: Nav2's NavigateToPose, odometry, scans, reports.

For a robot of namespace ``/digit``: the action ``/digit/navigate_to_pose``, the topics
``/digit/odom``, ``/digit/scan`` and the report topic, and a ``std_srvs/Trigger`` for each action.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from msgspec import Struct

from safenav.fleet.file.stations import Network, Station
from safenav.fleet.ros2 import messages as ros
from safenav.fleet.ros2 import streams
from safenav.fleet.ros2.node import LATCHED, RELIABLE, SENSOR, Client, Participant
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    InputHeard,
    Message,
    Performed,
    Reported,
    ignore,
    result_of,
)
from safenav.trace.vocabulary import ActResult

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

ACTION = "navigate_to_pose"
_ENDS = {
    ros.SUCCEEDED: GoalEnd.SUCCEEDED,
    ros.CANCELED: GoalEnd.CANCELED,
    ros.ABORTED: GoalEnd.ABORTED,
}


class _Pending(Struct):
    """A goal on its way through the action's services."""

    goal: GoalPoint
    uuid: list[int]
    canceling: bool = False


class _Robot:
    """The clients of one robot. Methods are called by the mission's thread and by cyclonedds'."""

    def __init__(
        self, name: str, station: Station, node: Participant, post: Callable[[Message], None]
    ) -> None:
        self._name = name
        self._post = post
        self._lock = Lock()
        self._pending: dict[int, _Pending] = {}  # by the number of the open call
        self._current: _Pending | None = None
        self._acts: dict[str, tuple[Client, dict[int, int]]] = {}
        action = station.path(f"{ACTION}/_action")
        self._send = Client(
            node, f"{action}/send_goal", ros.NavigateRequest, ros.NavigateReply, self._answered
        )
        self._result = Client(
            node, f"{action}/get_result", ros.ResultRequest, ros.ResultReply, self._ended
        )
        self._cancel = Client(
            node, f"{action}/cancel_goal", ros.CancelRequest, ros.CancelReply, self._canceling
        )
        self._results: dict[int, _Pending] = {}
        for service in dict.fromkeys(station.act.values()):
            self._add_service(service, station.path(service), node)

    # Goals

    @property
    def connected(self) -> bool:
        return self._send.connected and self._result.connected

    @property
    def foreign(self) -> str:
        """The middleware of its action server, if that is not Cyclone DDS."""
        return self._send.foreign or self._result.foreign

    def navigate(self, goal: GoalPoint) -> None:
        pending = _Pending(goal, list(uuid4().bytes))
        with self._lock:
            self._current = pending
            number = self._send.call(goal_id=ros.UUID(pending.uuid), goal=_navigate(goal))
            self._pending[number] = pending

    def cancel(self) -> None:
        with self._lock:
            pending = self._current
            if pending is None:
                return
            pending.canceling = True
            self._cancel.call(goal_info=ros.GoalInfo(ros.UUID(pending.uuid), ros.Time()))

    def _answered(self, reply: Any) -> None:
        with self._lock:
            pending = self._pending.pop(int(reply.number), None)
            if pending is None:
                return
            if reply.accepted:
                number = self._result.call(goal_id=ros.UUID(pending.uuid))
                self._results[number] = pending
                if pending.canceling:  # it was cancelled before the server accepted it
                    self._cancel.call(goal_info=ros.GoalInfo(ros.UUID(pending.uuid), ros.Time()))
                return
            self._forget(pending)
        self._post(GoalEnded(self._name, pending.goal.number, GoalEnd.REJECTED, "goal rejected"))

    def _ended(self, reply: Any) -> None:
        with self._lock:
            pending = self._results.pop(int(reply.number), None)
            if pending is None:
                return
            self._forget(pending)
        end = _ENDS.get(int(reply.status), GoalEnd.ABORTED)
        code = int(reply.result.error_code)
        reason = f"Nav2's error code {code}" if code else ""
        self._post(GoalEnded(self._name, pending.goal.number, end, reason))

    def _canceling(self, reply: Any) -> None:
        """Ignore the reply: the goal's result shows whether it is cancelled."""

    def _forget(self, pending: _Pending) -> None:
        if self._current is pending:
            self._current = None

    # Actions

    def _add_service(self, service: str, name: str, node: Participant) -> None:
        numbers: dict[int, int] = {}

        def take(reply: Any) -> None:
            with self._lock:
                number = numbers.pop(int(reply.number), None)
            if number is not None:
                result = result_of(bool(reply.success), str(reply.message))
                self._post(Performed(self._name, number, result, str(reply.message)))

        client = Client(node, name, ros.TriggerRequest, ros.TriggerReply, take)
        self._acts[service] = (client, numbers)

    def perform(self, service: str, number: int) -> None:
        client, numbers = self._acts[service]
        if not client.connected:
            why = f"no server of {service}"
            if client.foreign:
                why += f" with Cyclone DDS, but one with {client.foreign}"
            self._post(Performed(self._name, number, ActResult.FAILED, why))
            return
        with self._lock:
            numbers[client.call()] = number


class Ros2Transport:
    """A fleet on one domain of ROS 2. Use one at a time in a process."""

    def __init__(
        self, network: Network, stations: Mapping[str, Station], inputs: Mapping[str, str]
    ) -> None:
        self._network, self._stations, self._inputs = network, stations, inputs
        self._post: Callable[[Message], None] = ignore
        self._streams = streams.Streams(self._send)
        self._lock = Lock()
        self._robots: dict[str, _Robot] = {}
        self._references: dict[tuple[str, streams.Joints], Any] = {}
        self._node: Participant | None = None

    def open(self, post: Callable[[Message], None]) -> None:
        network, self._post = self._network, post
        self._node = node = Participant(network.domain, network.interface, network.peers)
        for name, station in self._stations.items():
            self._robots[name] = _Robot(name, station, node, post)
            follow = station.follow
            for joints, ending in streams.TOPICS.items() if follow is not None else ():
                assert follow is not None
                topic = _topic(station.path(follow.topic) + ending)
                self._references[name, joints] = node.writer(topic, ros.Trajectory, RELIABLE)
        for topic, kind, quality, take in self._topics():
            node.listen(_topic(topic), getattr(ros, kind), take, quality)

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
            end = GoalEnd.UNREACHABLE
            self._post(GoalEnded(robot, goal.number, end, "no action server"))

    def follow(self, robot: str, reference: Setpoints) -> None:
        self._streams.follow(robot, reference)

    def cancel(self, robot: str) -> None:
        if not self._streams.stop(robot):
            self._robots[robot].cancel()

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        del obstacle  # std_srvs/Trigger has no fields: the service knows what it works on
        self._robots[robot].perform(action, number)

    def close(self) -> None:
        self._streams.close()
        for robot in self._robots.values():
            robot.cancel()
        if self._node is not None:
            self._node.close()
        self._robots, self._references, self._node = {}, {}, None

    def _topics(self) -> Iterator[tuple[str, str, Any, Callable[[Any], None]]]:
        """Yield the topics to subscribe to: name, type, quality of service and message handler."""
        for name, topic in self._inputs.items():
            yield topic, "Bool", RELIABLE, partial(self._take, "Bool", name)
        for name, station in self._stations.items():
            if station.tf is None:
                yield station.pose_topic, "Odometry", SENSOR, partial(self._take, "Odometry", name)
            else:
                frames = streams.Transforms(name, station.tf.frame)
                for ending, quality in (("", RELIABLE), ("_static", LATCHED)):
                    take = partial(self._transformed, frames, static=bool(ending))
                    yield station.pose_topic + ending, "TFMessage", quality, take
            if station.scan is not None:
                topic = station.path(station.scan.topic)
                yield topic, "LaserScan", SENSOR, partial(self._take, "LaserScan", name)
            if station.report is not None:
                topic = station.path(station.report)
                yield topic, "String", RELIABLE, partial(self._take, "String", name)

    def _take(self, kind: str, name: str, message: Any) -> None:
        """Pass on a message about a robot or, if it is a Bool, an input."""
        if kind == "Bool":
            self._post(InputHeard(name, bool(message.data)))
        elif kind == "String":
            self._post(Reported(name, message.data.strip()))
        else:
            meaning = streams.located if kind == "Odometry" else streams.scanned
            found = meaning(name, streams.seconds_of(message.header.stamp), message)
            if found is not None:
                self._post(found)

    def _transformed(self, frames: streams.Transforms, message: Any, *, static: bool) -> None:
        with self._lock:  # both topics of a robot have threads of their own
            found = frames.take(message, static=static)
        if found is not None:
            self._post(found)

    def _answers(self, robot: str) -> bool:
        """Return whether a robot's action server answers or, for a follower, its references are
        subscribed to."""
        reference = self._references.get((robot, streams.BODY))
        if reference is not None:
            return bool(reference.get_matched_subscriptions())
        return self._robots[robot].connected

    def _send(
        self, robot: str, joints: streams.Joints, frames: list[streams.TrajectoryFrame]
    ) -> None:
        header = ros.MessageHeader(_whole(ros.Time, time.time()), streams.FRAME)
        points = [_point(frame) for frame in frames]
        self._references[robot, joints].write(ros.Trajectory(header, [*joints], points))


def _point(frame: streams.TrajectoryFrame) -> Any:
    """Return a point of a ``trajectory_msgs/MultiDOFJointTrajectory``."""
    places = [
        ros.Transform(ros.Vector3(x, y, z), ros.Quaternion(0.0, 0.0, *streams.facing(yaw)))
        for x, y, z, yaw in frame.poses
    ]
    rates = (
        [ros.Twist(ros.Vector3(*of), ros.Vector3(0.0, 0.0, 0.0))] if of else []
        for of in (frame.velocity, frame.acceleration)
    )
    after = _whole(ros.Duration, frame.after)
    return ros.MultiDOFJointTrajectoryPoint(places, *rates, after)


def _topic(name: str) -> str:
    """Return the name of a topic on the wire."""
    return f"rt/{name.lstrip('/')}"


def _whole(kind: Any, seconds: float) -> Any:
    """Return seconds as a time or duration of ROS 2."""
    return kind(int(seconds), int(seconds % 1 * 1e9))


def _navigate(goal: GoalPoint) -> Any:
    turn = ros.Quaternion(0.0, 0.0, *streams.facing(goal.yaw))
    pose = ros.PlacedPose(ros.Point(goal.x, goal.y, 0.0), turn)
    header = ros.MessageHeader(ros.Time(), streams.FRAME)
    return ros.NavigateGoal(ros.PoseStamped(header, pose), "")
