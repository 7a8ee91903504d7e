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
from functools import cache
from pathlib import Path
from typing import Any

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import final
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from fleet.lab import physics_of
from once import beside, from_yaml
from safenav.fleet.transport import Performed

DEFINED = from_yaml(beside(__file__, "interfaces.yaml"))
CONFIGURATION = """<CycloneDDS><Domain><General>
<Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast>
</General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>
</Discovery></Domain></CycloneDDS>"""
idl: Any = types


@cache
def typestore() -> Any:
    """The definitions of interfaces that another library has, and those of ``interfaces.yaml``."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in DEFINED["definitions"].items():
        store.register(get_types_from_msg(text, name))
    return store


@cache
def message(name: str) -> Any:
    """The class of a message by its definition; a request or reply begins with its header."""
    package, _, last = name.split("/")
    called = last.endswith(("_Request", "_Response"))
    folder = "action" if last.startswith("NavigateToPose") else "srv" if called else "msg"
    fields: dict[str, Any] = {"client": idl.uint64, "number": idl.int64} if called else {}
    fields |= {key: _type(*what) for key, what in typestore().fielddefs[name][1]}
    return final(make_idl_struct(last, f"{package}::{folder}::dds_::{last}_", fields))


def _type(shape: Any, detail: Any) -> Any:
    if shape.name == "NAME":
        return message(detail)
    if shape.name == "BASE":
        return {"string": str, "bool": bool}.get(detail[0]) or getattr(idl, detail[0])
    inner, size = _type(*detail[0]), detail[1]
    return idl.array[inner, size] if shape.name == "ARRAY" else idl.sequence[inner]


def new(name: str, **given: Any) -> Any:
    """A message; fields that are not given are zero or empty."""
    fields = {key: _zero(*what) for key, what in typestore().fielddefs[name][1]}
    return message(name)(**fields | given)


def _zero(shape: Any, detail: Any) -> Any:
    if shape.name == "NAME":
        return new(detail)
    if shape.name == "BASE":
        return "" if detail[0] == "string" else False if detail[0] == "bool" else 0
    return [_zero(*detail[0])] * detail[1] if shape.name == "ARRAY" else []


_RELIABLY = Policy.Reliability.Reliable(duration(seconds=1))
_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
QUALITIES = {
    "service": Qos(_RELIABLY, Policy.History.KeepAll, _CDR),
    "reliable": Qos(_RELIABLY, Policy.History.KeepLast(10), _CDR),
    "sensor": Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5), _CDR),
    "latched": Qos(_RELIABLY, Policy.Durability.TransientLocal, Policy.History.KeepLast(10), _CDR),
}


class Hearing(Listener):
    """Passes the messages of a reader on."""

    def __init__(self, take: Callable[[Any], None]) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._give = take

    def on_data_available(self, reader: Any) -> None:
        for each in reader.take(N=256):
            if each.sample_info.valid_data:
                self._give(each)


class Node:
    """A participant of a domain on the loopback interface."""

    def __init__(self, domain: int) -> None:
        self._kept: list[Any] = [Domain(domain, CONFIGURATION)]
        self._participant = DomainParticipant(domain)

    def _topic(self, name: str, kind: str, quality: str) -> Any:
        return Topic(self._participant, name, message(kind), qos=QUALITIES[quality])

    def listen(self, name: str, kind: str, take: Callable[[Any], None]) -> None:
        topic, qos = self._topic(name, kind, "service"), QUALITIES["service"]
        reader = DataReader(self._participant, topic, qos=qos, listener=Hearing(take))
        self._kept.append(reader)

    def writer(self, name: str, kind: str, quality: str = "reliable") -> Any:
        topic = self._topic(name, kind, quality)
        return DataWriter(self._participant, topic, qos=QUALITIES[quality])


PERIOD = 0.01
"""Seconds between two messages."""
IDLE = 5
"""How much slower time passes while no robot moves: half of a drive, for the processor."""
LAG, LATE = 0.06, 0.03
"""Seconds by which scans are late: those of one region come when the robot is in the next one; and
by which replies are."""
STATUS = {"succeeded": 4, "canceled": 5, "aborted": 6}
"""Final states of a goal (action_msgs/msg/GoalStatus)."""
ACTION, TIME = "nav2_msgs/msg/NavigateToPose", "builtin_interfaces/msg/Time"
Calls = queue.SimpleQueue[Callable[[], object] | None]


def turned(yaw: float) -> Any:
    return new("geometry_msgs/msg/Quaternion", z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def transform(parent: str, child: str, at: tuple[float, float, float], stamp: Any) -> Any:
    x, y, yaw = at
    place = new("geometry_msgs/msg/Vector3", x=x, y=y)
    moved = new("geometry_msgs/msg/Transform", translation=place, rotation=turned(yaw))
    named = {"header": header(stamp, parent), "child_frame_id": child}
    one = new("geometry_msgs/msg/TransformStamped", **named, transform=moved)
    return new("tf2_msgs/msg/TFMessage", transforms=[one])


def header(stamp: Any, frame: str) -> Any:
    return new("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def of(request: Any) -> dict[str, int]:
    """The header of the reply to a request."""
    return {"client": request.client, "number": request.number}


class Server:
    """Nav2 of one robot: an action server, odometry, a lidar, reports, a service per action. All
    its methods are called by one thread, in which ``calls`` are made."""

    def __init__(self, physics: Any, robot: str, node: Node, calls: Calls) -> None:
        self.physics, (self.name, *self.faults) = physics, robot.split("+")
        self.goals, self.goal = 0, b""
        self.waiting: dict[bytes, dict[str, int]] = {}
        self.ended: dict[bytes, int] = {}
        self.acting: list[tuple[Any, dict[str, int]]] = []
        self.outbox: list[tuple[float, Callable[[], None]]] = []

        def serves(service: str, kind: str, take: Callable[[Any], None]) -> Any:
            def taken(request: Any) -> None:
                calls.put(lambda: take(request))

            node.listen(f"rq/{self.name}/{service}Request", f"{kind}_Request", taken)
            return node.writer(f"rr/{self.name}/{service}Reply", f"{kind}_Response", "service")

        action = "navigate_to_pose/_action"
        self.accept = serves(f"{action}/send_goal", f"{ACTION}_SendGoal", self.sent)
        self.tell = serves(f"{action}/get_result", f"{ACTION}_GetResult", self.asked)
        self.stop = serves(f"{action}/cancel_goal", "action_msgs/msg/CancelGoal", self.cancelled)
        self.acts = {
            word: serves(
                word, "std_srvs/msg/Trigger", lambda request, word=word: self.called(word, request)
            )
            for word in ("push", "sense")
        }

        topic, transforms = f"rt/{self.name}", "tf2_msgs/msg/TFMessage"
        self.odom = node.writer(f"{topic}/odom", "nav_msgs/msg/Odometry")
        self.tf = node.writer(f"{topic}/tf", transforms)
        self.fixed = node.writer(f"{topic}/tf_static", transforms, "latched")
        if "tf" in self.faults:
            at = (0.1, 0.0, 0.0)
            self.fixed.write(transform("base_footprint", f"{self.name}/base", at, new(TIME)))
        self.scans = node.writer(f"{topic}/scan", "sensor_msgs/msg/LaserScan", "sensor")
        self.reports = node.writer(f"{topic}/obstacles", "std_msgs/msg/String")
        self.alarm = node.writer("rt/building/alarm", "std_msgs/msg/Bool")

    def later(self, seconds: float, send: Callable[[], None]) -> None:
        self.outbox.append((time.monotonic() + seconds, send))

    # Requests

    def sent(self, request: Any) -> None:
        self.end("aborted")
        pose = request.goal.pose.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        self.goal, self.goals = bytes(request.goal_id.uuid), self.goals + 1
        for _ in range(1 + ("doubled" in self.faults)):
            self.accept.write(new(f"{ACTION}_SendGoal_Response", **of(request), accepted=True))
        if "abort" in self.faults and self.goals == 3:
            self.end("aborted")
        else:
            at = pose.position
            self.physics.send(self.name, at.x, at.y, yaw, self.goals)

    def end(self, how: str) -> None:
        """End the present goal, if there is one."""
        if self.goal:
            self.ended[self.goal] = STATUS[how]
            self.answer(self.goal)
            self.goal = b""

    def asked(self, request: Any) -> None:
        goal = bytes(request.goal_id.uuid)
        self.waiting[goal] = of(request)
        self.answer(goal)

    def answer(self, goal: bytes) -> None:
        """Tell how a goal has ended, once it has, and that is asked."""
        if goal in self.ended and goal in self.waiting:
            ended = {**self.waiting.pop(goal), "status": self.ended[goal]}
            for _ in range(1 + ("doubled" in self.faults)):
                self.tell.write(new(f"{ACTION}_GetResult_Response", **ended))

    def cancelled(self, request: Any) -> None:
        self.stop.write(new("action_msgs/msg/CancelGoal_Response", **of(request)))
        self.physics.cancel(self.name)

    def called(self, word: str, request: Any) -> None:
        self.acting.append((self.acts[word], of(request)))
        self.physics.perform(self.name, word, 0)

    # Topics

    def publish(self) -> None:
        (located, ended), now = self.physics.told(self.name), time.time()
        x, y, yaw = located.x, located.y, located.yaw
        stamp = new(TIME, sec=int(now), nanosec=int(now % 1 * 1e9))
        on_map = header(stamp, "map")
        if "tf" not in self.faults:
            point = new("geometry_msgs/msg/Point", x=x, y=y)
            place = new("geometry_msgs/msg/Pose", position=point, orientation=turned(yaw))
            body = new("geometry_msgs/msg/PoseWithCovariance", pose=place)
            self.odom.write(new("nav_msgs/msg/Odometry", header=on_map, pose=body))
        else:  # odometry began elsewhere, turned by a quarter; the localization knows where
            x, y = x - 0.1 * math.cos(yaw), y - 0.1 * math.sin(yaw)
            drifted = (y - 2.0, 1.0 - x, yaw - math.pi / 2)
            self.tf.write(transform("map", "odom", (1.0, 2.0, math.pi / 2), stamp))
            self.tf.write(transform("odom", "base_footprint", drifted, stamp))
        if "alarm" in self.faults:
            self.alarm.write(new("std_msgs/msg/Bool", data=self.goals == 1))
        late = LATE if "late" in self.faults else 0.0
        for each in ended:
            if isinstance(each, Performed):
                for reply, asked in self.acting:
                    said = {"success": each.result == "done", "message": each.result.value}
                    answer = new("std_srvs/msg/Trigger_Response", **asked, **said)
                    self.later(late, lambda reply=reply, answer=answer: reply.write(answer))  # type: ignore[misc]
                self.acting = []
            elif each.number == self.goals:
                self.later(late, lambda how=each.end.value: self.end(how))  # type: ignore[misc]
        if not self.physics.moves(self.name):
            for found in filter(None, self.physics.noticed(self.name).values()):
                self.reports.write(new("std_msgs/msg/String", data=found))
            _, ranges = self.physics.scan(self.name)
            limits = {"angle_max": 2 * math.pi, "range_min": 0.05, "range_max": 7.5}
            limits["angle_increment"] = 2 * math.pi / len(ranges)
            scan = new("sensor_msgs/msg/LaserScan", header=on_map, ranges=ranges, **limits)
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
    physics, node, calls = physics_of(scenario, fleet), Node(domain), Calls()
    servers = [Server(physics, robot, node, calls) for robot in robots]
    threading.Thread(target=commands, args=(physics, calls), daemon=True).start()
    print(json.dumps("ready"), flush=True)
    due, speed = time.monotonic(), 1.0  # at the pace of a clock until a robot moves
    while True:
        try:
            call = calls.get(timeout=max(0.001, due - time.monotonic()))
            if call is None:
                return
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
