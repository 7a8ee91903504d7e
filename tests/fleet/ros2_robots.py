"""``python ros2_robots.py DOMAIN ROBOT...``: robots of a lab as ROS 2 nodes, over loopback.

The port of the lab is the first line of its standard input. A robot may have faults:
``digit+doubled`` sends every reply twice, ``+late`` 30 ms late, ``+abort`` aborts its
third goal, ``+alarm`` raises an alarm from its first goal to its second, ``+lag`` tells what its
lidar has seen later than its odometry, ``+tf`` sends transforms instead of odometry. Written from
ROS 2's action design and rmw_cyclonedds' names; it ends with its standard input.
"""

import math
import sys
import threading
import time
from collections import deque
from typing import Any

from fleet.lab import ends, lab_at
from safenav.fleet.ros2 import node as ros
from safenav.fleet.ros2.node import LATCHED, RELIABLE, SENSOR, SERVICE, Participant

LAG = 0.06
"""Seconds by which scans are late: those of one region come when the robot is in the next one."""
STATUS = {"succeeded": ros.SUCCEEDED, "aborted": ros.ABORTED, "canceled": ros.CANCELED}


def transform(parent: str, child: str, place: tuple[float, float, float], stamp: Any = None) -> Any:
    x, y, yaw = place
    turn = ros.Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    moved = ros.Transform(ros.Vector3(x, y, 0.0), turn)
    header = ros.MessageHeader(stamp or ros.Time(), parent)
    return ros.TFMessage([ros.TransformStamped(header, child, moved)])


class Server:
    """Nav2 of one robot: an action server, odometry, a lidar, reports, a service per action."""

    def __init__(self, lab: Any, name: str, node: Participant, faults: set[str]) -> None:
        self.lab, self.name, self.faults, self.goals = lab, name, faults, 0
        self.goal: bytes | None = None
        self.waiting: dict[bytes, tuple[int, int]] = {}
        self.ended: dict[bytes, int] = {}
        self.acting: list[tuple[Any, int, int]] = []
        self.late: deque[tuple[float, Any]] = deque()
        self.lock = threading.RLock()
        space = f"/{name}"
        action = f"{space}/navigate_to_pose/_action"
        self.accept = node.writer(f"rr{action}/send_goalReply", ros.NavigateReply, SERVICE)
        self.tell = node.writer(f"rr{action}/get_resultReply", ros.ResultReply, SERVICE)
        self.yes = node.writer(f"rr{action}/cancel_goalReply", ros.CancelReply, SERVICE)
        self.odom = node.writer(f"rt{space}/odom", ros.Odometry, RELIABLE)
        self.tf = node.writer(f"rt{space}/tf", ros.TFMessage, RELIABLE)
        if "tf" in faults:
            self.fixed = node.writer(f"rt{space}/tf_static", ros.TFMessage, LATCHED)
            self.fixed.write(transform("base_footprint", f"{name}/base", (0.1, 0.0, 0.0)))
        self.scans = node.writer(f"rt{space}/scan", ros.LaserScan, SENSOR)
        self.reports = node.writer(f"rt{space}/obstacles", ros.String, RELIABLE)
        self.feedback = node.writer(f"rt{action}/feedback", ros.FeedbackMessage, RELIABLE)
        node.listen(f"rq{action}/send_goalRequest", ros.NavigateRequest, self.sent, SERVICE)
        node.listen(f"rq{action}/get_resultRequest", ros.ResultRequest, self.asked, SERVICE)
        node.listen(f"rq{action}/cancel_goalRequest", ros.CancelRequest, self.cancelled, SERVICE)
        self.alarm = node.writer("rt/building/alarm", ros.Bool, RELIABLE)
        for word in ("push", "sense"):
            self.serve(node, space, word)

    def serve(self, node: Participant, space: str, word: str) -> None:
        reply = node.writer(f"rr{space}/{word}Reply", ros.TriggerReply, SERVICE)

        def called(request: Any) -> None:
            with self.lock:
                self.acting.append((reply, request.client, request.number))
            self.lab.perform(self.name, word)

        node.listen(f"rq{space}/{word}Request", ros.TriggerRequest, called, SERVICE)

    def sent(self, request: Any) -> None:
        pose = request.goal.pose.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        with self.lock:
            if self.goal is not None:
                self.end("aborted")
            self.goal, self.goals = bytes(request.goal_id.uuid), self.goals + 1
            stops = "abort" in self.faults and self.goals == 3
            if not stops:
                self.lab.send(self.name, pose.position.x, pose.position.y, yaw)
        for _ in range(1 + ("doubled" in self.faults)):
            self.accept.write(ros.NavigateReply(request.client, request.number, True, ros.Time()))
        if stops:
            self.end("aborted")

    def end(self, how: str) -> None:
        with self.lock:
            if self.goal is None:
                return
            self.ended[self.goal] = STATUS[how]
            asked = self.waiting.pop(self.goal, None)
            if asked:
                self.result(asked, STATUS[how])
            self.goal = None

    def result(self, asked: tuple[int, int], status: int) -> None:
        for _ in range(1 + ("doubled" in self.faults)):
            self.tell.write(ros.ResultReply(*asked, status, ros.NavigateResult(0)))

    def asked(self, request: Any) -> None:
        with self.lock:
            goal = bytes(request.goal_id.uuid)
            if goal in self.ended:
                self.result((request.client, request.number), self.ended[goal])
            else:
                self.waiting[goal] = (request.client, request.number)

    def cancelled(self, request: Any) -> None:
        self.yes.write(ros.CancelReply(request.client, request.number, 0, []))
        self.lab.stop(self.name)

    def publish(self) -> None:
        with self.lock:
            robot = self.lab.state(self.name)
            goal, acting = self.goal, self.acting
            if robot["acted"] is not None:
                self.acting = []
        now = time.time()
        stamp = ros.Time(int(now), int(now % 1 * 1e9))
        turn = ros.Quaternion(0.0, 0.0, math.sin(robot["yaw"] / 2), math.cos(robot["yaw"] / 2))
        pose = ros.PlacedPose(ros.Point(robot["x"], robot["y"], 0.0), turn)
        header = ros.MessageHeader(stamp, "map")
        if "tf" not in self.faults:
            self.odom.write(ros.Odometry(header, "base_link", ros.PoseWithCovariance(pose)))
        else:  # odometry began elsewhere, turned by a quarter; the localization knows where
            x, y, yaw = robot["x"], robot["y"], robot["yaw"]
            x, y = x - 0.1 * math.cos(yaw), y - 0.1 * math.sin(yaw)
            drifted = (y - 2.0, 1.0 - x, yaw - math.pi / 2)
            self.tf.write(transform("map", "odom", (1.0, 2.0, math.pi / 2), stamp))
            self.tf.write(transform("odom", "base_footprint", drifted, stamp))
        if "alarm" in self.faults:
            self.alarm.write(ros.Bool(self.goals == 1))
        if goal is not None:
            told = ros.NavigateFeedback(ros.PoseStamped(header, pose))
            self.feedback.write(ros.FeedbackMessage(ros.UUID(list(goal)), told))
        if "late" in self.faults and (robot["end"] or robot["acted"]):
            time.sleep(0.03)
        if robot["end"] is not None:
            self.end(robot["end"])
        for reply, client, number in acting if robot["acted"] is not None else ():
            good = robot["acted"] == "done"
            reply.write(ros.TriggerReply(client, number, good, robot["acted"]))
        if not robot["moves"]:
            for found in filter(None, self.lab.noticed(self.name).values()):
                self.reports.write(ros.String(found))
            _, ranges = self.lab.scan(self.name)
            step = 2 * math.pi / len(ranges)
            laser = ros.LaserScan(header, 0.0, 2 * math.pi, step, 0.0, 0.0, 0.05, 7.5, ranges, [])
            self.late.append((time.monotonic() + (LAG if "lag" in self.faults else 0.0), laser))
        while self.late and self.late[0][0] <= time.monotonic():
            self.scans.write(self.late.popleft()[1])


def main(domain: int, robots: list[str]) -> None:
    port = int(sys.stdin.readline())
    node = Participant(domain, "lo", ("127.0.0.1",))
    named = [robot.split("+") for robot in robots]
    servers = [Server(lab_at(port), name, node, set(faults)) for name, *faults in named]
    end = ends()
    print("ready", flush=True)
    while not end.wait(0.01):
        for server in servers:
            server.publish()
    node.close()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
