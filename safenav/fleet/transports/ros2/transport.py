"""Robots with ROS 2 under rmw_cyclonedds: Nav2's NavigateToPose, odometry, scans, reports.

For a robot of namespace ``/digit``: the action ``/digit/navigate_to_pose``, the topics
``/digit/odom``, ``/digit/scan`` and the report topic, and a ``std_srvs/Trigger`` for each action.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from threading import Lock
from typing import Any
from uuid import uuid4

from msgspec import Struct

from safenav.fleet.stations import Network, Station
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Message,
    Performed,
    result_of,
)
from safenav.fleet.transports import ros as topics
from safenav.fleet.transports.ros2 import messages as ros
from safenav.fleet.transports.ros2.node import RELIABLE, SENSOR, Client, Participant
from safenav.trace.vocabulary import ActResult

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
            self._post(Performed(self._name, number, ActResult.FAILED, f"no server of {service}"))
            return
        with self._lock:
            numbers[client.call()] = number


class Ros2Transport(topics.RosTransport):
    """A fleet on one domain of ROS 2. Use one at a time in a process."""

    action = ACTION

    def __init__(
        self, network: Network, stations: Mapping[str, Station], inputs: Mapping[str, str]
    ) -> None:
        super().__init__(network, stations, inputs)
        self._robots: dict[str, _Robot] = {}
        self._references: dict[tuple[str, topics.Joints], Any] = {}
        self._node: Participant | None = None

    def open(self, post: Callable[[Message], None]) -> None:
        network, self._post = self._network, post
        self._node = node = Participant(network.domain, network.interface, network.peers)
        for name, station in self._stations.items():
            self._robots[name] = _Robot(name, station, node, post)
            follow = station.follow
            for joints, ending in topics.TOPICS.items() if follow is not None else ():
                assert follow is not None
                topic = _topic(station.path(follow.topic) + ending)
                self._references[name, joints] = node.writer(topic, ros.Trajectory, RELIABLE)
        for topic, kind, take in self._topics():
            quality = SENSOR if kind in ("Odometry", "LaserScan") else RELIABLE
            node.listen(_topic(topic), getattr(ros, kind), take, quality)

    def _answers(self, robot: str) -> bool:
        reference = self._references.get((robot, topics.BODY))
        if reference is not None:
            return bool(reference.get_matched_subscriptions())
        return self._robots[robot].connected

    def _navigate(self, robot: str, goal: GoalPoint) -> None:
        self._robots[robot].navigate(goal)

    @staticmethod
    def _seconds(stamp: Any) -> float:
        return float(stamp.sec) + float(stamp.nanosec) * 1e-9

    def _stop(self, robot: str) -> None:
        self._robots[robot].cancel()

    def _send(
        self, robot: str, joints: topics.Joints, frames: list[topics.TrajectoryFrame]
    ) -> None:
        header = ros.MessageHeader(_whole(ros.Time, time.time()), topics.FRAME)
        points = topics.points_of(ros, frames, lambda seconds: _whole(ros.Duration, seconds))
        self._references[robot, joints].write(ros.Trajectory(header, [*joints], points))

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


def _topic(name: str) -> str:
    """Return the name of a topic on the wire."""
    return f"rt/{name.lstrip('/')}"


def _whole(kind: Any, seconds: float) -> Any:
    """Return seconds as a time or duration of ROS 2."""
    return kind(int(seconds), int(seconds % 1 * 1e9))


def _navigate(goal: GoalPoint) -> Any:
    turn = ros.Quaternion(0.0, 0.0, *topics.facing(goal.yaw))
    pose = ros.PlacedPose(ros.Point(goal.x, goal.y, 0.0), turn)
    header = ros.MessageHeader(ros.Time(), topics.FRAME)
    return ros.NavigateGoal(ros.PoseStamped(header, pose), "")
