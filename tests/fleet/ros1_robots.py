"""``python ros1_robots.py PORT ROBOT...``: robots of a lab as ROS 1 nodes with real action servers.

PORT is the lab's. ``digit+abort`` aborts its third goal, ``digit+die`` never ends its fourth;
``digit+alarm`` raises an alarm from its first goal to its second. It ends with its standard input.
"""

import math
import sys
import threading
import time
from typing import Any

sys.path.append("/usr/lib/python3/dist-packages")

import actionlib
import rospy
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger, TriggerResponse
from trajectory_msgs.msg import MultiDOFJointTrajectory

from fleet.lab import SILENT, ends, follow, lab_at


class Robot:
    """move_base, odometry, a lidar, reports, a service per action."""

    def __init__(self, lab: Any, name: str, faults: set[str]) -> None:
        self.lab, self.name, self.faults, self.goals = lab, name, faults, 0
        self.ended: str | None = None
        self.acted: str | None = None
        self.odom = rospy.Publisher(f"/{name}/odom", Odometry, queue_size=5)
        self.scans = rospy.Publisher(f"/{name}/scan", LaserScan, queue_size=5)
        self.reports = rospy.Publisher(f"/{name}/obstacles", String, queue_size=5)
        for word in ("push", "sense"):
            self.serve(word)
        self.alarm = rospy.Publisher("/building/alarm", Bool, queue_size=5)
        self.heard = math.inf
        if "follow" in faults:
            topic = f"/{name}/reference"
            rospy.Subscriber(topic, MultiDOFJointTrajectory, self.followed, queue_size=1)
        self.server = actionlib.SimpleActionServer(
            f"/{name}/move_base", MoveBaseAction, self.go, auto_start=False
        )
        self.server.start()

    def followed(self, part: Any) -> None:
        self.heard = time.monotonic()
        frames = [
            (p.transforms[0], p.velocities[0].linear, p.accelerations[0].linear)
            for p in part.points
        ]
        follow(self.lab, self.name, frames)

    def serve(self, word: str) -> None:
        def called(_: Any) -> Any:
            self.acted = None
            self.lab.perform(self.name, word)
            while self.acted is None and not rospy.is_shutdown():
                time.sleep(0.005)
            return TriggerResponse(success=self.acted == "done", message=self.acted or "")

        rospy.Service(f"/{self.name}/{word}", Trigger, called)

    def go(self, goal: Any) -> None:
        self.goals += 1
        if "abort" in self.faults and self.goals == 3:
            self.server.set_aborted(text="aborted on purpose")
            return
        if "die" in self.faults and self.goals == 4:
            threading.Event().wait()  # it never answers again
        pose = goal.target_pose.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        self.ended = None
        self.lab.send(self.name, pose.position.x, pose.position.y, yaw)
        stopped = False
        while self.ended is None and not rospy.is_shutdown():
            if self.server.is_preempt_requested() and not stopped:
                stopped = True
                self.lab.stop(self.name)
            time.sleep(0.005)
        ways = {
            "succeeded": self.server.set_succeeded,
            "aborted": self.server.set_aborted,
            "canceled": self.server.set_preempted,
        }
        if self.ended is not None:
            ways[self.ended]()

    def publish(self) -> None:
        if time.monotonic() - self.heard > SILENT:
            self.lab.stop(self.name)
            self.heard = math.inf
        robot = self.lab.state(self.name)
        stamp = rospy.Time.now()
        told = Odometry()
        told.header.stamp = stamp
        told.pose.pose.position.x, told.pose.pose.position.y = robot["x"], robot["y"]
        told.pose.pose.orientation.z = math.sin(robot["yaw"] / 2)
        told.pose.pose.orientation.w = math.cos(robot["yaw"] / 2)
        self.odom.publish(told)
        if "alarm" in self.faults:
            self.alarm.publish(Bool(self.goals == 1))
        self.ended = robot["end"] or self.ended
        self.acted = robot["acted"] or self.acted
        if robot["goal"] is None:
            for found in filter(None, self.lab.noticed(self.name).values()):
                self.reports.publish(String(found))
            _, ranges = self.lab.scan(self.name)
            scan = LaserScan(angle_min=0.0, angle_max=2 * math.pi, range_min=0.05, range_max=7.5)
            scan.header.stamp = stamp
            scan.angle_increment, scan.ranges = 2 * math.pi / len(ranges), ranges
            self.scans.publish(scan)


def main(port: int, robots: list[str]) -> None:
    rospy.init_node("robots", anonymous=True, disable_signals=True)
    named = [robot.split("+") for robot in robots]
    served = [Robot(lab_at(port), name, set(faults)) for name, *faults in named]
    end = ends()
    print("ready", flush=True)
    while not end.wait(0.01):
        for robot in served:
            robot.publish()
    rospy.signal_shutdown("over")


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
