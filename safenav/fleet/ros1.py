"""Robots that speak ROS 1: move_base by actionlib, odometry, scans, reports, std_srvs/Trigger.

rospy and its messages come from Debian's packages, not from PyPI. A virtual environment does not
see them, so the system's folder is added behind its own.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from math import atan2, cos, inf, sin
from pathlib import Path
from threading import Thread
from typing import Any

from safenav.errors import UsageError
from safenav.fleet.fleet_file import Network, Station
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Located,
    Message,
    Performed,
    Reported,
    Scanned,
    result_of,
)
from safenav.trace.vocabulary import ActResult

DEBIAN = "/usr/lib/python3/dist-packages"
PACKAGES = "python3-rospy python3-actionlib python3-move-base-msgs"
FRAME = "map"
_ENDS = {2: GoalEnd.CANCELED, 3: GoalEnd.SUCCEEDED, 4: GoalEnd.ABORTED, 5: GoalEnd.REJECTED}
"""Final states of actionlib_msgs/GoalStatus; the others count as aborted."""


def importable() -> bool:
    """Whether rospy is there, with Debian's folder added where that helps."""
    if find_spec("rospy") is None and Path(DEBIAN, "rospy").is_dir() and DEBIAN not in sys.path:
        sys.path.append(DEBIAN)
    return all(find_spec(name) is not None for name in ("rospy", "actionlib", "move_base_msgs"))


class Ros1Transport:
    """A fleet behind one ROS master. A process can have one, once: rospy has one node."""

    def __init__(self, network: Network, stations: Mapping[str, Station]) -> None:
        if not importable():
            raise UsageError(
                f"transport ros1 needs rospy, which is not on PyPI\n    apt install {PACKAGES}"
            )
        self._network = network
        self._stations = stations
        self._post: Callable[[Message], None] = _ignore
        self._drives: dict[str, Any] = {}
        self._services: dict[tuple[str, str], Any] = {}
        self._topics: list[Any] = []
        self._ros: Any = None

    def open(self, post: Callable[[Message], None]) -> None:
        os.environ["ROS_MASTER_URI"] = self._network.master
        os.environ["ROS_IP"] = self._network.address
        import rospy

        self._ros, self._post = rospy, post
        self._find_master()
        rospy.init_node("safenav", anonymous=True, disable_signals=True)
        for name, station in self._stations.items():
            self._join(name, station)

    def _find_master(self) -> None:
        import rosgraph

        try:
            rosgraph.Master("/safenav").getPid()
        except (OSError, rosgraph.MasterException) as error:
            said = f"no ROS master at {self._network.master} ({error})"
            hint = "start one (roscore), or set 'master' of network"
            raise UsageError(f"{said}\n    {hint}") from error

    def _join(self, name: str, station: Station) -> None:
        import actionlib
        from move_base_msgs.msg import MoveBaseAction
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import LaserScan
        from std_msgs.msg import String
        from std_srvs.srv import Trigger

        space = station.namespace
        self._drives[name] = actionlib.SimpleActionClient(f"{space}/move_base", MoveBaseAction)

        def listen(topic: str, kind: Any, take: Callable[[str, Any], None]) -> None:
            subscriber = self._ros.Subscriber(
                f"{space}/{topic}", kind, lambda message: take(name, message), queue_size=5
            )
            self._topics.append(subscriber)

        listen("odom", Odometry, self._located)
        if station.scan is not None:
            listen(station.scan.topic, LaserScan, self._scanned)
        if station.report is not None:
            listen(station.report, String, self._reported)
        for service in set(station.act.values()):
            path = service if service.startswith("/") else f"{space}/{service}"
            self._services[name, service] = self._ros.ServiceProxy(path, Trigger)

    def missing(self) -> list[str]:
        return [
            f"{self._stations[name].namespace}/move_base"
            for name in self._drives
            if not self._serves(name)
        ]

    def _serves(self, robot: str) -> bool:
        return bool(self._drives[robot].wait_for_server(self._ros.Duration(0.01)))

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        from move_base_msgs.msg import MoveBaseGoal

        drive = self._drives[robot]
        if not self._serves(robot):
            self._post(GoalEnded(robot, goal.number, GoalEnd.UNREACHABLE, "no action server"))
            return
        message = MoveBaseGoal()
        pose = message.target_pose
        pose.header.frame_id = FRAME
        pose.pose.position.x, pose.pose.position.y = goal.x, goal.y
        yaw = goal.yaw or 0.0
        pose.pose.orientation.z, pose.pose.orientation.w = sin(yaw / 2), cos(yaw / 2)

        def done(state: int, _: Any) -> None:
            end = _ENDS.get(state, GoalEnd.ABORTED)
            self._post(GoalEnded(robot, goal.number, end, drive.get_goal_status_text()))

        drive.send_goal(message, done_cb=done)

    def cancel(self, robot: str) -> None:
        self._drives[robot].cancel_all_goals()

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        del obstacle
        service = self._services[robot, action]

        def call() -> None:
            try:
                reply = service()
                result, text = result_of(reply.success, reply.message), str(reply.message)
            except self._ros.ServiceException as error:
                result, text = ActResult.FAILED, str(error)
            self._post(Performed(robot, number, result, text))

        Thread(target=call, daemon=True).start()

    def close(self) -> None:
        if self._ros is None:
            return
        for drive in self._drives.values():
            drive.cancel_all_goals()
        for topic in self._topics:
            topic.unregister()
        self._post = _ignore
        self._ros.signal_shutdown("the mission is over")
        self._ros = None

    def _located(self, robot: str, odometry: Any) -> None:
        pose = odometry.pose.pose
        q = pose.orientation
        yaw = atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        stamp = odometry.header.stamp.to_sec()
        self._post(Located(robot, stamp, pose.position.x, pose.position.y, yaw))

    def _scanned(self, robot: str, scan: Any) -> None:
        ranges = [r if scan.range_min <= r <= scan.range_max else inf for r in scan.ranges]
        stamp = scan.header.stamp.to_sec()
        self._post(Scanned(robot, stamp, scan.angle_min, scan.angle_increment, ranges))

    def _reported(self, robot: str, report: Any) -> None:
        self._post(Reported(robot, report.data.strip()))


def _ignore(message: Message) -> None:
    """Nobody listens."""
