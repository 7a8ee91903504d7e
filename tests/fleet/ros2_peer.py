"""``python ros2_peer.py DOMAIN SCENARIO FLEET PACE ROBOT...``: robots of the physics simulation as
ROS 2 nodes, over loopback.

A robot may have faults: ``digit+doubled`` sends every reply twice, ``+late`` 30 ms late, ``+abort``
aborts its third goal, ``+alarm`` raises an alarm from its first goal to its second, ``+lag`` tells
what its lidar has seen later than its odometry, ``+tf`` sends transforms instead of odometry.
Written from ROS 2's action design and rmw_cyclonedds' names. Each line of its standard input is a
call of the physics in JSON, such as ``["log"]``, and answered by one; it ends with its input.
"""

import json
import math
import queue
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fleet.lab import watched
from safenav import load_scenario
from safenav.fleet.file import load_fleet
from safenav.fleet.lab.simulation import SimulationTransport
from safenav.fleet.ros2 import node as ros
from safenav.fleet.ros2.node import LATCHED, RELIABLE, SENSOR, SERVICE, Participant

PERIOD = 0.01
"""Seconds between two messages."""
IDLE = 5
"""How much slower time passes while no robot moves: half of a drive, for the processor."""
LAG, LATE = 0.06, 0.03
"""Seconds by which scans are late: those of one region come when the robot is in the next one; and
by which replies are."""
STATUS = {"succeeded": ros.SUCCEEDED, "aborted": ros.ABORTED, "canceled": ros.CANCELED}
Calls = queue.SimpleQueue[Callable[[], object] | None]


def turned(yaw: float) -> Any:
    return ros.Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def transform(parent: str, child: str, place: tuple[float, float, float], stamp: Any) -> Any:
    x, y, yaw = place
    moved = ros.Transform(ros.Vector3(x, y, 0.0), turned(yaw))
    header = ros.MessageHeader(stamp, parent)
    return ros.TFMessage([ros.TransformStamped(header, child, moved)])


class Server:
    """Nav2 of one robot: an action server, odometry, a lidar, reports, a service per action. All
    its methods are called by one thread, in which ``calls`` are made."""

    def __init__(self, physics: Any, robot: str, node: Participant, calls: Calls) -> None:
        self.physics, (self.name, *self.faults) = physics, robot.split("+")
        self.goals, self.goal = 0, b""
        self.waiting: dict[bytes, tuple[int, int]] = {}
        self.ended: dict[bytes, int] = {}
        self.acting: list[tuple[Any, int, int]] = []
        self.outbox: list[tuple[float, Callable[[], None]]] = []

        def serves(service: str, kind: str, take: Callable[[Any], None]) -> Any:
            def taken(request: Any) -> None:
                calls.put(lambda: take(request))

            node.listen(
                f"rq/{self.name}/{service}Request", getattr(ros, f"{kind}Request"), taken, SERVICE
            )
            return node.writer(
                f"rr/{self.name}/{service}Reply", getattr(ros, f"{kind}Reply"), SERVICE
            )

        action = "navigate_to_pose/_action"
        self.accept = serves(f"{action}/send_goal", "Navigate", self.sent)
        self.tell = serves(f"{action}/get_result", "Result", self.asked)
        self.stop = serves(f"{action}/cancel_goal", "Cancel", self.cancelled)
        self.acts = {
            word: serves(word, "Trigger", lambda request, word=word: self.called(word, request))
            for word in ("push", "sense")
        }

        def topic(name: str, kind: Any, quality: Any = RELIABLE) -> Any:
            return node.writer(f"rt/{self.name}/{name}", kind, quality)

        self.odom, self.tf = topic("odom", ros.Odometry), topic("tf", ros.TFMessage)
        self.fixed = topic("tf_static", ros.TFMessage, LATCHED)
        if "tf" in self.faults:
            at = (0.1, 0.0, 0.0)
            self.fixed.write(transform("base_footprint", f"{self.name}/base", at, ros.Time()))
        self.scans = topic("scan", ros.LaserScan, SENSOR)
        self.reports = topic("obstacles", ros.String)
        self.alarm = node.writer("rt/building/alarm", ros.Bool, RELIABLE)

    def later(self, seconds: float, send: Callable[[], None]) -> None:
        self.outbox.append((time.monotonic() + seconds, send))

    # Requests

    def sent(self, request: Any) -> None:
        self.end("aborted")
        pose = request.goal.pose.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        self.goal, self.goals = bytes(request.goal_id.uuid), self.goals + 1
        for _ in range(1 + ("doubled" in self.faults)):
            self.accept.write(ros.NavigateReply(request.client, request.number, True, ros.Time()))
        if "abort" in self.faults and self.goals == 3:
            self.end("aborted")
        else:
            self.physics.send(self.name, pose.position.x, pose.position.y, yaw)

    def end(self, how: str) -> None:
        """End the present goal, if there is one."""
        if self.goal:
            self.ended[self.goal] = STATUS[how]
            self.answer(self.goal)
            self.goal = b""

    def asked(self, request: Any) -> None:
        goal = bytes(request.goal_id.uuid)
        self.waiting[goal] = (request.client, request.number)
        self.answer(goal)

    def answer(self, goal: bytes) -> None:
        """Tell how a goal has ended, once it has, and that is asked."""
        if goal in self.ended and goal in self.waiting:
            asked = self.waiting.pop(goal)
            for _ in range(1 + ("doubled" in self.faults)):
                self.tell.write(ros.ResultReply(*asked, self.ended[goal], ros.NavigateResult(0)))

    def cancelled(self, request: Any) -> None:
        self.stop.write(ros.CancelReply(request.client, request.number, 0, []))
        self.physics.stop(self.name)

    def called(self, word: str, request: Any) -> None:
        self.acting.append((self.acts[word], request.client, request.number))
        self.physics.perform(self.name, word)

    # Topics

    def publish(self) -> None:
        robot, now = self.physics.state(self.name), time.time()
        x, y, yaw = robot["x"], robot["y"], robot["yaw"]
        stamp = ros.Time(int(now), int(now % 1 * 1e9))
        header = ros.MessageHeader(stamp, "map")
        pose = ros.PlacedPose(ros.Point(x, y, 0.0), turned(yaw))
        if "tf" not in self.faults:
            self.odom.write(ros.Odometry(header, "base_link", ros.PoseWithCovariance(pose)))
        else:  # odometry began elsewhere, turned by a quarter; the localization knows where
            x, y = x - 0.1 * math.cos(yaw), y - 0.1 * math.sin(yaw)
            drifted = (y - 2.0, 1.0 - x, yaw - math.pi / 2)
            self.tf.write(transform("map", "odom", (1.0, 2.0, math.pi / 2), stamp))
            self.tf.write(transform("odom", "base_footprint", drifted, stamp))
        if "alarm" in self.faults:
            self.alarm.write(ros.Bool(self.goals == 1))
        late = LATE if "late" in self.faults else 0.0
        if (end := robot["end"]) is not None:
            self.later(late, lambda: self.end(end))
        if (acted := robot["acted"]) is not None:
            for reply, *asked in self.acting:
                answer = ros.TriggerReply(*asked, acted == "done", acted)
                self.later(late, lambda reply=reply, answer=answer: reply.write(answer))  # type: ignore[misc]
            self.acting = []
        if not robot["moves"]:
            for found in filter(None, self.physics.noticed(self.name).values()):
                self.reports.write(ros.String(found))
            _, ranges = self.physics.scan(self.name)
            step = 2 * math.pi / len(ranges)
            scan = ros.LaserScan(header, 0.0, 2 * math.pi, step, 0.0, 0.0, 0.05, 7.5, ranges, [])
            self.later(LAG if "lag" in self.faults else 0.0, lambda: self.scans.write(scan))
        due = [send for at, send in self.outbox if at <= time.monotonic()]
        self.outbox = [(at, send) for at, send in self.outbox if send not in due]
        for send in due:
            send()


def commands(physics: Any, calls: Calls) -> None:
    """Make the calls on standard input; None at its end."""
    for line in sys.stdin:
        name, *arguments = json.loads(line)
        call = getattr(physics, name)
        calls.put(lambda call=call, given=arguments: print(json.dumps(call(*given)), flush=True))  # type: ignore[misc]
    calls.put(None)


def main(domain: int, scenario: Path, fleet: Path, pace: float, robots: list[str]) -> None:
    plan = load_scenario(scenario)
    given = load_fleet(fleet, plan)
    physics = watched(SimulationTransport(plan, given.stations, given.simulation).physics)
    node, calls = Participant(domain, "lo", ("127.0.0.1",)), Calls()
    servers = [Server(physics, robot, node, calls) for robot in robots]
    threading.Thread(target=commands, args=(physics, calls), daemon=True).start()
    print(json.dumps("ready"), flush=True)
    due, speed = time.monotonic(), 1.0  # at the pace of a clock until a robot moves
    while True:
        try:
            call = calls.get(timeout=max(0.001, due - time.monotonic()))
            if call is None:
                return node.close()
            call()
        except queue.Empty:
            physics.step(speed * PERIOD)
            for server in servers:
                server.publish()
            moving = bool(physics.moving())
            speed = pace if moving else speed if speed == 1.0 else pace / IDLE
            due = max(due, time.monotonic()) + PERIOD


if __name__ == "__main__":
    domain, scenario, fleet, pace, *robots = sys.argv[1:]
    main(int(domain), Path(scenario), Path(fleet), float(pace), robots)
