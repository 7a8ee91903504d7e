"""Robots that speak ROS 1: move_base by actionlib, odometry, scans, reports, std_srvs/Trigger.

rospy and its messages come from Debian's packages, not from PyPI. A virtual environment does not
see them, so the system's folder is added behind its own.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from safenav.errors import UsageError
from safenav.fleet import ros
from safenav.fleet.fleet_file import Network, Station
from safenav.fleet.ros import Streams
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


NOT_AN_ERROR = "on a goal handle that we're not tracking"
"""Part of the error that actionlib logs when the last news of a goal come after the next goal."""


def relevant(line: logging.LogRecord) -> bool:
    """Whether users are to read a line of the log of ROS."""
    return NOT_AN_ERROR not in line.getMessage()


def importable() -> bool:
    """Whether rospy is there, with Debian's folder added where that helps."""
    if find_spec("rospy") is None and Path(DEBIAN, "rospy").is_dir() and DEBIAN not in sys.path:
        sys.path.append(DEBIAN)
    return all(find_spec(name) is not None for name in MODULES)


class Ros1Transport:
    """A fleet behind one ROS master. A process can have one, once: rospy has one node."""

    def __init__(
        self, network: Network, stations: Mapping[str, Station], inputs: Mapping[str, str]
    ) -> None:
        if not importable():
            raise UsageError(
                f"transport ros1 needs rospy, which is not on PyPI\n    apt install {PACKAGES}"
            )
        self._network = network
        self._inputs = inputs
        self._stations = stations
        self._post: Callable[[Message], None] = ignore
        self._drives: dict[str, Any] = {}
        self._services: dict[tuple[str, str], Any] = {}
        self._topics: list[Any] = []
        self._references: dict[str, tuple[Any, Any]] = {}
        self._streams = Streams(self._stream)
        self._ros: Any = None

    def open(self, post: Callable[[Message], None]) -> None:
        os.environ["ROS_MASTER_URI"] = self._network.master
        os.environ["ROS_IP"] = self._network.address
        import rospy

        self._ros, self._post = rospy, post
        self._find_master()
        rospy.init_node("safenav", anonymous=True, disable_signals=True)
        logging.getLogger("rosout").addFilter(relevant)
        for name, station in self._stations.items():
            self._join(name, station)
        self._hear_inputs()

    def _hear_inputs(self) -> None:
        from std_msgs.msg import Bool

        for name, topic in self._inputs.items():

            def heard(message: Any, name: str = name) -> None:
                self._post(InputHeard(name, bool(message.data)))

            self._topics.append(self._ros.Subscriber(topic, Bool, heard, queue_size=5))

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
        if station.follow is None:
            self._drives[name] = actionlib.SimpleActionClient(f"{space}/move_base", MoveBaseAction)
        else:
            from trajectory_msgs.msg import MultiDOFJointTrajectory

            topic = f"{space}/{station.follow.topic}"
            reference, steps = (
                self._ros.Publisher(path, MultiDOFJointTrajectory, queue_size=1)
                for path in (topic, topic + ros.STEPS)
            )
            self._references[name] = reference, steps

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
        silent = [
            f"{self._stations[name].namespace}/move_base"
            for name in self._drives
            if not self._serves(name)
        ]
        unheard = [
            str(reference.name)
            for reference, _ in self._references.values()
            if not reference.get_num_connections()
        ]
        return silent + unheard

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
        pose.header.frame_id = ros.FRAME
        pose.pose.position.x, pose.pose.position.y = goal.x, goal.y
        pose.pose.orientation.z, pose.pose.orientation.w = ros.facing(goal.yaw)

        def done(state: int, _: Any) -> None:
            end = _ENDS.get(state, GoalEnd.ABORTED)
            self._post(GoalEnded(robot, goal.number, end, drive.get_goal_status_text()))

        drive.send_goal(message, done_cb=done)

    def follow(self, robot: str, reference: Setpoints) -> None:
        self._streams.follow(robot, reference)

    def _stream(self, robot: str, part: Setpoints) -> None:
        reference, steps = self._references[robot]
        reference.publish(self._trajectory([ros.MASS], ros.ahead_of(part)))
        if part.feet:
            steps.publish(self._trajectory([ros.LEFT, ros.RIGHT], ros.steps_of(part)))

    def _trajectory(self, joints: list[str], frames: list[ros.TrajectoryFrame]) -> Any:
        from geometry_msgs.msg import Quaternion, Transform, Twist, Vector3
        from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

        message = MultiDOFJointTrajectory(joint_names=joints)
        message.header.frame_id, message.header.stamp = ros.FRAME, self._ros.Time.now()
        for frame in frames:
            point = MultiDOFJointTrajectoryPoint()
            for x, y, z, yaw in frame.poses:
                turn = Quaternion(0.0, 0.0, *ros.facing(yaw))
                point.transforms.append(Transform(Vector3(x, y, z), turn))
            for found, values in (
                (point.velocities, frame.velocity),
                (point.accelerations, frame.acceleration),
            ):
                found += [Twist(Vector3(*values), Vector3())] if values else []
            point.time_from_start = self._ros.Duration.from_sec(frame.after)
            message.points.append(point)
        return message

    def cancel(self, robot: str) -> None:
        if self._streams.stop(robot) or robot not in self._drives:
            return
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
        for topic in self._topics:
            topic.unregister()
        self._post = ignore
        self._ros.signal_shutdown("the mission has ended")
        self._ros = None

    def _located(self, robot: str, odometry: Any) -> None:
        self._post(ros.located(robot, odometry.header.stamp.to_sec(), odometry))

    def _scanned(self, robot: str, scan: Any) -> None:
        self._post(ros.scanned(robot, scan.header.stamp.to_sec(), scan))

    def _reported(self, robot: str, report: Any) -> None:
        self._post(Reported(robot, report.data.strip()))
