"""Robots that speak ROS 2 under rmw_cyclonedds: Nav2's NavigateToPose, odometry, scans, reports.

For a robot of namespace ``/digit``: the action ``/digit/navigate_to_pose``, the topics
``/digit/odom``, ``/digit/scan`` and the report topic, and a ``std_srvs/Trigger`` for each action.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from threading import Lock
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from msgspec import Struct

from safenav.fleet import ros as common
from safenav.fleet.fleet_file import Network, Station
from safenav.fleet.ros import Streams
from safenav.fleet.ros2 import messages as ros
from safenav.fleet.ros2.node import RELIABLE, SENSOR, Client, Participant
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    InputHeard,
    Message,
    Performed,
    Reported,
    result_of,
)
from safenav.trace.vocabulary import ActResult

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

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
        self._pending: dict[int, _Pending] = {}  # by the number of the call that is open
        self._current: _Pending | None = None
        self._acts: dict[str, tuple[Client, dict[int, int]]] = {}
        self._station = station
        self._node = node
        space = station.namespace
        self.action = f"{space}/navigate_to_pose"
        action = f"{self.action}/_action"
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
        self._reference = self._steps = None
        if station.follow is not None:
            topic = f"rt{space}/{station.follow.topic}"
            self._reference = node.writer(topic, ros.Trajectory, RELIABLE)
            self._steps = node.writer(topic + common.STEPS, ros.Trajectory, RELIABLE)
        for service in dict.fromkeys(station.act.values()):
            self._add_service(service)
        node.listen(f"rt{space}/odom", ros.Odometry, self._located, SENSOR)
        if station.scan is not None:
            node.listen(f"rt{space}/{station.scan.topic}", ros.LaserScan, self._scanned, SENSOR)
        if station.report is not None:
            node.listen(f"rt{space}/{station.report}", ros.String, self._reported, RELIABLE)

    # References

    def stream(self, part: Setpoints) -> None:
        """Send the next second of a reference, and the next steps of a walker."""
        assert self._reference is not None and self._steps is not None
        self._reference.write(_trajectory([common.MASS], common.ahead_of(part)))
        if part.feet:
            feet = [common.LEFT, common.RIGHT]
            self._steps.write(_trajectory(feet, common.steps_of(part)))

    @property
    def named(self) -> str:
        """The topic or the action for which somebody has to be there."""
        follow = self._station.follow
        return self.action if follow is None else f"{self._station.namespace}/{follow.topic}"

    # Goals

    @property
    def connected(self) -> bool:
        if self._reference is not None:
            return bool(self._reference.get_matched_subscriptions())
        return self._send.connected and self._result.connected

    def navigate(self, goal: GoalPoint) -> None:
        if not self.connected:
            self._post(GoalEnded(self._name, goal.number, GoalEnd.UNREACHABLE, "no action server"))
            return
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
                if pending.canceling:  # it was cancelled before the server knew it
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
        """Ignored: the goal's result says whether it is cancelled."""

    def _forget(self, pending: _Pending) -> None:
        if self._current is pending:
            self._current = None

    # Actions

    def _add_service(self, service: str) -> None:
        numbers: dict[int, int] = {}

        def take(reply: Any) -> None:
            with self._lock:
                number = numbers.pop(int(reply.number), None)
            if number is not None:
                result = result_of(bool(reply.success), str(reply.message))
                self._post(Performed(self._name, number, result, str(reply.message)))

        name = service if service.startswith("/") else f"{self._station.namespace}/{service}"
        client = Client(self._node, name, ros.TriggerRequest, ros.TriggerReply, take)
        self._acts[service] = (client, numbers)

    def perform(self, service: str, number: int) -> None:
        client, numbers = self._acts[service]
        if not client.connected:
            self._post(Performed(self._name, number, ActResult.FAILED, f"no server of {service}"))
            return
        with self._lock:
            numbers[client.call()] = number

    # What it senses

    def _located(self, odometry: Any) -> None:
        self._post(common.located(self._name, _seconds(odometry), odometry))

    def _scanned(self, scan: Any) -> None:
        self._post(common.scanned(self._name, _seconds(scan), scan))

    def _reported(self, report: Any) -> None:
        self._post(Reported(self._name, report.data.strip()))


class Ros2Transport:
    """A fleet on one domain of ROS 2. Use one at a time in a process."""

    def __init__(
        self, network: Network, stations: Mapping[str, Station], inputs: Mapping[str, str]
    ) -> None:
        self._network = network
        self._inputs = inputs
        self._stations = stations
        self._robots: dict[str, _Robot] = {}
        self._node: Participant | None = None
        self._streams = Streams(lambda robot, part: self._robots[robot].stream(part))

    def open(self, post: Callable[[Message], None]) -> None:
        network = self._network
        self._node = Participant(network.domain, network.interface, network.peers)
        self._robots = {
            name: _Robot(name, station, self._node, post)
            for name, station in self._stations.items()
        }
        for name, topic in self._inputs.items():

            def heard(message: Any, name: str = name) -> None:
                post(InputHeard(name, bool(message.data)))

            self._node.listen(f"rt/{topic.lstrip('/')}", ros.Bool, heard, RELIABLE)

    def missing(self) -> list[str]:
        return [robot.named for robot in self._robots.values() if not robot.connected]

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        self._robots[robot].navigate(goal)

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
        self._robots, self._node = {}, None


def _seconds(message: Any) -> float:
    """Creation time of a message, in seconds of its sender's clock."""
    stamp = message.header.stamp
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def _navigate(goal: GoalPoint) -> Any:
    turn = ros.Quaternion(0.0, 0.0, *common.facing(goal.yaw))
    pose = ros.PlacedPose(ros.Point(goal.x, goal.y, 0.0), turn)
    header = ros.MessageHeader(ros.Time(), common.FRAME)
    return ros.NavigateGoal(ros.PoseStamped(header, pose), "")


def _trajectory(joints: list[str], frames: list[common.TrajectoryFrame]) -> Any:
    now = time.time()
    stamp = ros.Time(int(now), int(now % 1 * 1e9))
    points = [
        ros.TrajectoryPoint(
            [
                ros.Transform(ros.Vector3(x, y, z), ros.Quaternion(0.0, 0.0, *common.facing(yaw)))
                for x, y, z, yaw in frame.poses
            ],
            [ros.Twist(ros.Vector3(*frame.velocity))] if frame.velocity else [],
            [ros.Twist(ros.Vector3(*frame.acceleration))] if frame.acceleration else [],
            ros.Duration(int(frame.after), int(frame.after % 1 * 1e9)),
        )
        for frame in frames
    ]
    return ros.Trajectory(ros.MessageHeader(stamp, common.FRAME), joints, points)
