"""Robots with ROS 1: move_base by actionlib, odometry, scans, reports, std_srvs/Trigger.

rospy and its messages come from Debian's packages, not from PyPI. A virtual environment does not
see them, so the system's folder is added behind its own.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
import xmlrpc.client
from collections.abc import Callable, Mapping
from http.client import HTTPException
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any
from xml.parsers.expat import ExpatError

from safenav.errors import UsageError
from safenav.fleet.stations import Network, Station
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Message,
    Performed,
    ignore,
    result_of,
)
from safenav.fleet.transports import ros
from safenav.trace.vocabulary import ActResult

DEBIAN = "/usr/lib/python3/dist-packages"
PACKAGES = (
    "python3-rospy python3-actionlib python3-move-base-msgs python3-nav-msgs python3-sensor-msgs "
    "python3-std-srvs python3-trajectory-msgs"
)
MODULES = (
    "rospy",
    "actionlib",
    "move_base_msgs",
    "nav_msgs",
    "sensor_msgs",
    "std_srvs",
    "trajectory_msgs",
)
_ENDS = {2: GoalEnd.CANCELED, 3: GoalEnd.SUCCEEDED, 4: GoalEnd.ABORTED, 5: GoalEnd.REJECTED}
"""Final states of actionlib_msgs/GoalStatus; the others count as aborted."""


SILENT = 5.0
"""Seconds within which a ROS master must answer."""
OTHERS = (HTTPException, xmlrpc.client.Error, ExpatError)
"""Errors of servers that are not a ROS master."""
NOT_AN_ERROR = "on a goal handle that we're not tracking"
"""Part of the error that actionlib logs when the last status of a goal arrives after the next
goal."""


def relevant(line: logging.LogRecord) -> bool:
    """Return whether a line of the ROS log is relevant to users."""
    return NOT_AN_ERROR not in line.getMessage()


def importable() -> bool:
    """Return whether rospy can be imported, adding Debian's folder if necessary."""
    if find_spec("rospy") is None and Path(DEBIAN, "rospy").is_dir() and DEBIAN not in sys.path:
        sys.path.append(DEBIAN)
    return all(find_spec(name) is not None for name in MODULES)


def find_master(uri: str) -> None:
    """Raises UsageError if no ROS master answers there."""
    import rosgraph

    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(SILENT)
    try:
        rosgraph.Master("/safenav", uri).getPid()
    except (OSError, ValueError, *OTHERS, rosgraph.MasterException) as error:
        problem = f"no ROS master at {uri} ({error})"
        hint = "start one (roscore), or set 'master' of network"
        raise UsageError(f"{problem}\n    {hint}") from error
    finally:
        socket.setdefaulttimeout(before)


class Ros1Transport(ros.RosTransport):
    """A fleet behind one ROS master. A process can open only one, once, since rospy has a single
    node."""

    action = "move_base"

    def __init__(
        self, network: Network, stations: Mapping[str, Station], inputs: Mapping[str, str]
    ) -> None:
        if not importable():
            raise UsageError(
                f"transport ros1 needs rospy, which is not on PyPI\n    apt install {PACKAGES}"
            )
        super().__init__(network, stations, inputs)
        self._drives: dict[str, Any] = {}
        self._services: dict[tuple[str, str], Any] = {}
        self._heard: list[Any] = []
        self._reports: dict[str, Any] = {}
        self._references: dict[tuple[str, ros.Joints], Any] = {}
        self._ros: Any = None

    def open(self, post: Callable[[Message], None]) -> None:
        os.environ["ROS_MASTER_URI"] = self._network.master
        os.environ["ROS_IP"] = self._network.address
        find_master(self._network.master)
        import rospy
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import LaserScan
        from std_msgs.msg import Bool, String

        self._ros, self._post = rospy, post
        rospy.init_node("safenav", anonymous=True, disable_signals=True)
        logging.getLogger("rosout").addFilter(relevant)
        for name, station in self._stations.items():
            self._join(name, station)
        kinds = {"Bool": Bool, "Odometry": Odometry, "LaserScan": LaserScan, "String": String}
        for topic, kind, take in self._topics():
            heard = rospy.Subscriber(topic, kinds[kind], take, queue_size=5)
            self._heard.append(heard)
            if kind == "String":
                self._reports[topic] = heard

    def missing(self) -> list[str]:
        reports = self._reports.items()  # published once, perhaps, so not before a subscriber
        unheard = [topic for topic, heard in reports if not heard.get_num_connections()]
        return [*super().missing(), *unheard]

    def _join(self, name: str, station: Station) -> None:
        import actionlib
        from move_base_msgs.msg import MoveBaseAction
        from std_srvs.srv import Trigger
        from trajectory_msgs.msg import MultiDOFJointTrajectory

        if station.follow is None:
            place = station.path(self.action)
            self._drives[name] = actionlib.SimpleActionClient(place, MoveBaseAction)
        else:
            for joints, ending in ros.TOPICS.items():
                topic = station.path(station.follow.topic) + ending
                writer = self._ros.Publisher(topic, MultiDOFJointTrajectory, queue_size=1)
                self._references[name, joints] = writer
        for service in set(station.act.values()):
            self._services[name, service] = self._ros.ServiceProxy(station.path(service), Trigger)

    def _answers(self, robot: str) -> bool:
        if robot in self._drives:
            return bool(self._drives[robot].wait_for_server(self._ros.Duration(0.01)))
        return bool(self._references[robot, ros.BODY].get_num_connections())

    def _navigate(self, robot: str, goal: GoalPoint) -> None:
        from move_base_msgs.msg import MoveBaseGoal

        drive = self._drives[robot]
        message = MoveBaseGoal()
        pose = message.target_pose
        pose.header.frame_id = ros.FRAME
        pose.pose.position.x, pose.pose.position.y = goal.x, goal.y
        pose.pose.orientation.z, pose.pose.orientation.w = ros.facing(goal.yaw)

        def done(state: int, _: Any) -> None:
            end = _ENDS.get(state, GoalEnd.ABORTED)
            self._post(GoalEnded(robot, goal.number, end, drive.get_goal_status_text()))

        drive.send_goal(message, done_cb=done)

    def _send(self, robot: str, joints: ros.Joints, frames: list[ros.TrajectoryFrame]) -> None:
        from geometry_msgs import msg as geometry
        from trajectory_msgs import msg as trajectory

        kinds = SimpleNamespace(**{**vars(geometry), **vars(trajectory)})
        message = trajectory.MultiDOFJointTrajectory(joint_names=[*joints])
        message.header.frame_id, message.header.stamp = ros.FRAME, self._ros.Time.now()
        message.points = ros.points_of(kinds, frames, self._ros.Duration.from_sec)
        self._references[robot, joints].publish(message)

    @staticmethod
    def _seconds(stamp: Any) -> float:
        return float(stamp.to_sec())

    def _stop(self, robot: str) -> None:
        if robot in self._drives:
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
        self._streams.close()
        for drive in self._drives.values():
            drive.cancel_all_goals()
        for topic in self._heard:
            topic.unregister()
        self._post = ignore
        self._ros.signal_shutdown("the mission has ended")
        self._ros = None
