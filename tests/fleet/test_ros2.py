"""The messages of ROS 2: their bytes, against an independent serializer with its own definitions;
what they mean, and what their transport refuses."""

import json
import os
import random
import re
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from math import atan2, cos, inf, nan, pi, sin
from pathlib import Path
from queue import SimpleQueue
from threading import Condition
from types import SimpleNamespace as Message
from typing import Any
from unittest.mock import Mock

import pytest
from msgspec.structs import replace

pytest.importorskip("cyclonedds", reason="the ROS 2 transport needs the extra 'ros2'")
pytest.importorskip("numpy", reason="references need the extra 'motion'")

import numpy

from fleet.lab import drive_in
from fleet.ros2_peer import DEFINED, typestore
from once import beside
from safenav import ActResult, Clock, check_trace, load_scenario_text
from safenav.fleet.file import FollowUse, Network, Station
from safenav.fleet.ros2 import node
from safenav.fleet.ros2 import transport as streams
from safenav.fleet.ros2.interfaces import INTERFACES
from safenav.fleet.ros2.node import Client, Taking
from safenav.fleet.setpoints import PERIOD, Setpoints
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Located,
    Performed,
    Places,
    Scanned,
)
from safenav.fleet.world import FleetWorld


def drawn(name: str, rng: random.Random) -> Any:
    """A random value of a type, by the serializer's own description of it."""
    store = typestore()
    fields = store.fielddefs[name][1]
    return store.types[name](**{field: _drawn(what, rng) for field, what in fields})


INTEGERS = {f"{sign}int{bits}": (sign, bits) for sign in ("u", "") for bits in (8, 16, 32, 64)}


def _drawn(what: Any, rng: random.Random) -> Any:
    shape, detail = what
    if shape.name == "BASE":
        return _base(detail[0], rng)
    if shape.name == "NAME":
        return drawn(detail, rng)
    inner, size = detail
    counts = (0, 1, 2, 7, 360) if inner[0].name == "BASE" else (0, 1, 3)
    count = size if shape.name == "ARRAY" else rng.choice(counts)
    values = [_drawn(inner, rng) for _ in range(count)]
    if inner[0].name == "BASE" and inner[1][0] != "string":
        return numpy.array(values, dtype=numpy.dtype(inner[1][0].replace("octet", "uint8")))
    return values


def _base(name: str, rng: random.Random) -> Any:
    if name in INTEGERS or name == "octet":
        sign, bits = INTEGERS.get(name, ("u", 8))
        least = 0 if sign else -(2 ** (bits - 1))
        return rng.choice((least, least + 2**bits - 1, rng.randrange(least, least + 2**bits)))
    if name == "bool":
        return rng.random() < 0.5
    if name == "string":
        return "".join(rng.choice("ab/_ äλ") for _ in range(rng.choice((0, 1, 2, 3, 4, 5, 40))))
    value = rng.choice((0.0, -0.0, inf, rng.uniform(-1e6, 1e6), rng.random()))
    if name == "float32":
        return float(numpy.float32(value))
    return value


def named(what: Any) -> str:
    """A type of the other library in our notation, without folders."""
    shape, detail = what
    if shape.name in ("BASE", "NAME"):
        return re.sub("/(msg|srv|action)/", "/", detail if shape.name == "NAME" else detail[0])
    return f"{named(detail[0])}[{detail[1] or ''}]"


def test_message_fields_agree_with_those_of_another_library() -> None:
    """In their order and with their signs, which the bytes alone do not show."""
    for name, fields in INTERFACES.items():
        package, *_, kind = name.split("/")
        theirs = typestore().fielddefs[f"{package}/msg/{kind}"][1]
        mine = [(re.sub("/(msg|srv|action)/", "/", kind), key) for kind, key in fields]
        assert mine == [(named(what), field) for field, what in theirs], name


@pytest.mark.parametrize("name", DEFINED["kinds"], ids=lambda name: name.split("/")[-1])
def test_messages_are_serialized_as_by_another_library(name: str, values: int = 200) -> None:
    """A request or reply begins with its header, after which CDR restarts its count by 8."""
    rng = random.Random(name)
    kind = node.message(DEFINED["kinds"][name])
    for _ in range(values):
        theirs = bytes(typestore().serialize_cdr(drawn(name, rng), name))
        client, number = rng.getrandbits(64), rng.getrandbits(62)
        headed = "client" in kind.__dataclass_fields__
        header = client.to_bytes(8, "little") + number.to_bytes(8, "little") if headed else b""
        sent = theirs[:4] + header + theirs[4:]
        message = kind.deserialize(sent)
        assert not headed or (message.client, message.number) == (client, number)
        wire = message.serialize(use_version_2=False)
        assert wire[:2] == sent[:2] == b"\x00\x01"
        assert wire[4 : len(sent)] == sent[4:] and not any(wire[len(sent) :])


YAWS = (0.0, 1.0, pi / 2, 3.0, -3.0, -pi / 2)
TILTED = (cos(0.55) * cos(0.2), -sin(0.55) * sin(0.2), cos(0.55) * sin(0.2), sin(0.55) * cos(0.2))
"""A pitch of 0.4 rad, then a yaw of 1.1 rad."""


@pytest.mark.parametrize(
    ("turn", "east", "yaw"),
    [
        *(((streams.facing(yaw)[1], 0.0, 0.0, streams.facing(yaw)[0]), 1.0, yaw) for yaw in YAWS),
        (TILTED, 1.0, 1.1),
        ((1.0, 0.0, 0.0, 0.0), nan, None),
        ((1.0, 0.0, 0.0, 0.0), inf, None),
        ((1.0, 0.0, 0.0, nan), 1.0, None),
    ],
)
def test_odometry_gives_the_yaw_of_the_orientation_and_is_ignored_unless_finite(
    turn: tuple[float, ...], east: float, yaw: float | None
) -> None:
    """Odometry that is not finite puts a robot in no region, and must not end the drive."""
    pose = Message(
        position=Message(x=east, y=-2.0),
        orientation=Message(**dict(zip("wxyz", turn, strict=True))),
    )
    found = streams.located("digit", 7.5, Message(pose=Message(pose=pose)))
    wanted = None if yaw is None else Located("digit", 7.5, 1.0, -2.0, pytest.approx(yaw))
    assert found == wanted


def transforms(*parts: tuple[str, str, float, tuple[float, float, float]]) -> Message:
    return Message(
        transforms=[
            Message(
                header=Message(frame_id=parent, stamp=Message(sec=stamp, nanosec=0)),
                child_frame_id=child,
                transform=Message(
                    translation=Message(x=x, y=y),
                    rotation=Message(x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2)),
                ),
            )
            for parent, child, stamp, (x, y, yaw) in parts
        ]
    )


def test_a_pose_is_composed_of_all_transforms_at_the_stamp_of_odometry() -> None:
    """The localization corrects odometry later, with a stamp in the future: no new pose."""
    frames = streams.Transforms("quad", "base_link")
    fixed = transforms(("base", "base_link", 0, (0.5, 0.0, 0.0)))
    moved = ("odom", "base", 7, (2.0, 0.0, 0.0))
    assert frames.take(fixed, static=True) is None
    assert frames.take(transforms(moved), static=False) is None  # no localization yet
    assert frames.take(transforms(("map", "odom", 9, (1.0, 1.0, pi / 2))), static=False) is None
    found = frames.take(transforms(moved, ("world", "map", 7, (0.0, 0.0, 1.0))), static=False)
    assert found is not None
    assert (found.stamp, found.x, found.y) == (7.0, pytest.approx(1.0), pytest.approx(3.5))
    assert found.yaw == pytest.approx(pi / 2)
    loop = transforms(("base", "odom", 8, (0.0, 0.0, 0.0)))
    assert frames.take(loop, static=False) is None


@pytest.mark.parametrize(
    ("guid", "other"), [("0110", ""), ("010f", "Fast DDS"), ("0199", "middleware 0199")]
)
def test_a_server_of_other_middleware_gets_no_request(guid: str, other: str) -> None:
    """It would read the header of a request as lengths."""
    written: list[object] = []
    key = Message(bytes=bytes.fromhex(guid) + bytes(14))
    writer = Message(
        get_matched_subscriptions=lambda: [1],
        get_matched_subscription_data=lambda _: Message(participant_key=key),
        write=written.append,
    )
    peer: Any = Message(client=1, listen=lambda *_: None, writer=lambda *_: writer)
    client = Client(peer, "/push", "std_srvs/srv/Trigger")
    client.call(print)
    assert (client.foreign, client.connected, len(written)) == (other, not other, int(not other))


@pytest.mark.parametrize(
    ("told", "metres"),
    [(2.0, 2.0), (9.0, inf), (inf, inf), (0.05, nan), (0.0, nan), (nan, nan), (-inf, 0.1)],
)
def test_a_range_outside_the_limits_of_a_lidar_is_infinite_or_unknown(
    told: float, metres: float
) -> None:
    """As in REP 117: an obstacle too near to be measured is not a free path."""
    limits = {"range_min": 0.1, "range_max": 5.0, "angle_min": -1.0, "angle_increment": 0.5}
    found = streams.scanned("quad", 3.0, Message(**limits, ranges=[told, 1.0]))
    assert found.ranges == pytest.approx([metres, 1.0], nan_ok=True)
    assert found == Scanned("quad", 3.0, -1.0, 0.5, found.ranges)


def test_a_stream_is_the_reference_sample_by_sample() -> None:
    sent: list[Any] = []
    ros = streams.Ros2Transport(Network(), {}, {})
    ros._references["digit"] = Message(write=sent.append)
    ros._send("digit", Setpoints(4.0, PERIOD, numpy.arange(30, dtype=float).reshape(3, 10)))
    assert [p.time_from_start.nanosec / 1e9 for p in sent[0].points] == [0.0, PERIOD, 2 * PERIOD]
    place, point = sent[0].points[1].transforms[0], sent[0].points[1]
    assert [place.translation.x, place.translation.y, place.translation.z] == [10.0, 11.0, 12.0]
    assert [*vars(place.rotation).values()] == [0.0, 0.0, *streams.facing(19.0)]
    for of, x in ((point.velocities, 13.0), (point.accelerations, 16.0)):
        assert (of[0].linear.x, *vars(of[0].angular).values()) == (x, 0.0, 0.0, 0.0)


class Ideal(streams.Ros2Transport):
    """The transport, and robots on its network that are where the last message of their stream has
    them. Time passes while the run waits, once each robot has got its stream of that time, and its
    odometry has come back: no machine is too slow."""

    def __init__(self, network: Network, stations: dict[str, Station], places: Any) -> None:
        super().__init__(network, stations, {})
        self.time, self.places, self.changed = 0.0, places, Condition()
        self.located, self.streamed = (dict.fromkeys(places, -1.0) for _ in range(2))

    def now(self) -> float:
        return self.time

    def open(self, post: Callable[[Any], None]) -> None:
        def posted(message: Any) -> None:
            post(message)
            self.changes(self.located, message.robot, message.stamp)

        super().open(posted)
        for name in self.places:
            take = partial(self.follow_to, name)
            self._node.listen(f"rt/{name}/reference", node.TRAJECTORY, take, node.RELIABLE)
        self.odometry = {
            name: self._node.writer(f"rt/{name}/odom", "nav_msgs/Odometry", node.RELIABLE)
            for name in self.places
        }

    def changes(self, what: dict[str, float], name: str, stamp: float) -> None:
        with self.changed:
            what[name] = max(what[name], stamp)
            self.changed.notify()

    def follow_to(self, name: str, part: Any) -> None:
        at = part.points[0].transforms[0]
        place, turn = at.translation, at.rotation
        self.places[name] = place.x, place.y, 2 * atan2(turn.z, turn.w)
        self.changes(self.streamed, name, streams.seconds_of(part.header.stamp))

    def step(self) -> None:
        header = node.MessageHeader(streams._whole(node.Time, self.time), "map")
        for name, (x, y, yaw) in self.places.items():
            turn = node.Quaternion(0.0, 0.0, *streams.facing(yaw))
            pose = node.PlacedPose(node.Point(x, y, 0.0), turn)
            body = node.message("geometry_msgs/PoseWithCovariance")(pose)
            odometry = node.message("nav_msgs/Odometry")(header, "base_link", body)
            self.odometry[name].write(odometry)
        self.waits(self.located, self.places)
        self.time += PERIOD
        self.waits(self.streamed, self._streams._references)

    def waits(self, what: dict[str, float], names: Any) -> None:
        with self.changed:
            there = self.changed.wait_for(
                lambda: all(what[name] > self.time - PERIOD / 2 for name in names), timeout=300
            )
            assert there, (what, self.time)


def test_robots_follow_their_streams_until_these_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rover and a flyer, one step each; a robot that has arrived still gets its stream."""
    text = beside(__file__, "scenarios/streamed.yaml")
    plan = replace(load_scenario_text(text, "yard.yaml"), clock=Clock.LIVE)
    stations = {name: Station(f"/{name}", follow=FollowUse()) for name in ("quad", "cart")}
    places = Places(plan.map, plan.map.frame)
    rests = {r.name: (*places.centre(r.start.region), 0.0) for r in plan.robots}
    robots = Ideal(Network(domain=20 + os.getpid() % 200), stations, rests)
    monkeypatch.setattr(streams, "time", Message(monotonic=robots.now, time=robots.now))
    monkeypatch.setattr(streams, "PERIOD", 0.002)  # it looks at the clock so often
    lines, _ = drive_in(FleetWorld(plan, stations, robots), plan, tmp_path / "trace.jsonl")
    assert json.loads(lines[-1])["outcome"] == "completed" and check_trace(lines).findings == ()
    regions = [places.region(*robots.places[name][:2]) for name in ("quad", "cart")]
    assert regions == [8, 14]
    assert min(robots.streamed.values()) > robots.time - 2 * PERIOD
    assert robots._node is None  # closed: the streams have ended


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux binds a socket to an interface")
def test_every_socket_of_ros_2_is_confined_to_its_interface() -> None:
    """cyclonedds itself listens on all addresses."""

    def sockets() -> set[tuple[str, bytes]]:
        """The sockets of this process: addresses and interfaces."""
        found = set()
        for entry in Path("/proc/self/fd").iterdir():
            with suppress(OSError), socket.socket(fileno=os.dup(int(entry.name))) as one:
                if one.family in (socket.AF_INET, socket.AF_INET6):
                    bound = one.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16)
                    found.add((f"{one.getsockname()[0]}:{one.getsockname()[1]}", bound))
        return found

    before = sockets()
    ros = streams.Ros2Transport(Network(domain=20 + os.getpid() % 200), {}, {})
    ros.open(lambda _: None)
    opened = sockets() - before
    ros.close()
    anyone = {bound for address, bound in opened if address.startswith("0.0.0.0:")}
    assert anyone == {b"lo\0"}
    assert all(address.startswith(("0.0.0.0:", "127.0.0.1:")) for address, _ in opened)


def test_goals_and_actions_without_a_server_fail_and_a_goal_is_cancelled_once_accepted() -> None:
    """The server of a robot is slow: it accepts a goal after its cancellation. It rejects the
    next one."""
    told = SimpleQueue[Any]()
    stations = {"digit": Station("/digit", act={"push": "push"})}
    ros = streams.Ros2Transport(Network(domain=20 + os.getpid() % 200), stations, {})
    ros.open(told.put)
    goal, action = GoalPoint(1, 0.0, 0.0, None), "/digit/navigate_to_pose"
    ros.navigate("digit", goal)
    ros.perform("digit", "push", "door@9", 2)
    assert told.get_nowait() == GoalEnded("digit", 1, GoalEnd.UNREACHABLE, "no action server")
    assert told.get_nowait() == Performed("digit", 2, ActResult.FAILED, "no server of push")
    assert ros.missing() == [action]
    asked, served = SimpleQueue[Any](), f"{action}/_action"
    for service, kind in (
        ("send_goal", sends := f"{streams.NAVIGATE}_SendGoal"),
        ("get_result", asks := f"{streams.NAVIGATE}_GetResult"),
        ("cancel_goal", cancels := "action_msgs/srv/CancelGoal"),
    ):
        request = f"{kind}_Request"
        ros._node.listen(f"rq{served}/{service}Request", request, asked.put, node.SERVICE)
    accept = ros._node.writer(f"rr{served}/send_goalReply", f"{sends}_Response", node.SERVICE)
    while ros.missing():
        time.sleep(0.01)
    ros.navigate("digit", goal)
    sent = asked.get(timeout=300)
    ros.cancel("digit")
    assert asked.get(timeout=300).goal_info.goal_id == sent.goal_id
    accepted = node.message(f"{sends}_Response")
    accept.write(accepted(sent.client, sent.number, True, node.Time()))
    kinds = {type(asked.get(timeout=300)) for _ in range(2)}
    assert kinds == {node.message(f"{kind}_Request") for kind in (asks, cancels)}
    ros.navigate("digit", replace(goal, number=2))
    sent = asked.get(timeout=300)
    accept.write(accepted(sent.client, sent.number, False, node.Time()))
    assert told.get(timeout=300) == GoalEnded("digit", 2, GoalEnd.REJECTED, "goal rejected")
    ros._robots["digit"].cancel = cancel = Mock()  # type: ignore[method-assign]
    ros.close()
    cancel.assert_called_once_with()


def test_messages_for_a_closed_reader_are_ignored() -> None:
    """A drive that ends closes its readers while robots still send."""
    heard: list[str] = []
    sent = Message(valid_data=True)
    reader = Message(take=lambda **_: [Message(sample_info=sent, text="on")])
    listener = Taking(lambda message: heard.append(message.text))
    listener.on_data_available(None)
    listener.on_data_available(reader)
    assert heard == ["on"]
