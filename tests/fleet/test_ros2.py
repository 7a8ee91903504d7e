"""What the messages of ROS 2 mean, and what its transport refuses."""

from math import cos, inf, nan, pi, sin
from types import SimpleNamespace as Message
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the ROS 2 transport needs the extra 'ros2'")
pytest.importorskip("numpy", reason="references need the extra 'motion'")

import numpy

from safenav.errors import UsageError
from safenav.fleet.file import Network
from safenav.fleet.ros2 import transport as streams
from safenav.fleet.ros2.node import Client, Participant, Taking
from safenav.fleet.setpoints import PERIOD, Setpoints
from safenav.fleet.transport import Located, Scanned
from safenav.motion.file import Foothold


def odometry(w: float, x: float, y: float, z: float, east: float = 1.0) -> Message:
    turn = Message(w=w, x=x, y=y, z=z)
    return Message(pose=Message(pose=Message(position=Message(x=east, y=-2.0), orientation=turn)))


@pytest.mark.parametrize("yaw", [0.0, 1.0, pi / 2, 3.0, -3.0, -pi / 2])
def test_a_direction_is_received_as_it_was_sent(yaw: float) -> None:
    z, w = streams.facing(yaw)
    found = streams.located("digit", 7.5, odometry(w, 0.0, 0.0, z))
    assert found == Located("digit", 7.5, 1.0, -2.0, pytest.approx(yaw))


def test_a_tilted_robot_has_the_yaw_of_its_heading() -> None:
    """A pitch of 0.4 rad, then a yaw of 1.1 rad."""
    a, b = 0.55, 0.2
    w, x, y, z = cos(a) * cos(b), -sin(a) * sin(b), cos(a) * sin(b), sin(a) * cos(b)
    found = streams.located("quad", 0.0, odometry(w, x, y, z))
    assert found is not None and found.yaw == pytest.approx(1.1)


@pytest.mark.parametrize(("east", "z"), [(nan, 0.0), (inf, 0.0), (1.0, nan)])
def test_odometry_that_is_not_finite_is_ignored(east: float, z: float) -> None:
    """A robot is in no region by it; the drive ended with an internal error, robots under way."""
    assert streams.located("quad", 0.0, odometry(1.0, 0.0, 0.0, z, east)) is None


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


def test_a_pose_from_transforms_is_that_of_the_whole_chain_when_odometry_moves() -> None:
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
    node = Message(client=1, listen=lambda *_: None, writer=lambda *_: writer)
    client = Client(node, "/push", lambda **fields: fields, object)
    client.call(print)
    assert (client.foreign, client.connected, len(written)) == (other, not other, int(not other))


@pytest.mark.parametrize(
    ("told", "metres"),
    [(2.0, 2.0), (9.0, inf), (inf, inf), (0.05, nan), (0.0, nan), (nan, nan), (-inf, 0.1)],
)
def test_a_range_outside_the_limits_of_a_lidar_has_its_meaning(told: float, metres: float) -> None:
    """As in REP 117: what is too near to be measured is no free way."""
    limits = {"range_min": 0.1, "range_max": 5.0, "angle_min": -1.0, "angle_increment": 0.5}
    found = streams.scanned("quad", 3.0, Message(**limits, ranges=[told, 1.0]))
    assert found.ranges == pytest.approx([metres, 1.0], nan_ok=True)
    assert found == Scanned("quad", 3.0, -1.0, 0.5, found.ranges)


def test_a_stream_is_the_reference_sample_by_sample() -> None:
    sent: list[Any] = []
    ros = streams.Ros2Transport(Network(), {}, {})
    ros._references["digit", streams.BODY] = Message(write=sent.append)
    ros._send("digit", Setpoints(4.0, PERIOD, numpy.arange(30, dtype=float).reshape(3, 10)))
    points = sent[0].points
    assert [p.time_from_start.nanosec / 1e9 for p in points] == [0.0, PERIOD, 2 * PERIOD]
    place, point = points[1].transforms[0], points[1]
    assert [place.translation.x, place.translation.y, place.translation.z] == [10.0, 11.0, 12.0]
    assert (place.rotation.z, place.rotation.w) == streams.facing(19.0)
    assert [rates[0].linear.x for rates in (point.velocities, point.accelerations)] == [13.0, 16.0]


def test_steps_describe_both_feet_from_each_landing_on() -> None:
    feet = (
        Foothold(1.0, 0.2, 0.1, 1, 8.0, 10.4),
        Foothold(1.0, -0.2, 0.1, -1, 9.0, 11.0),
        Foothold(1.6, 0.2, 0.2, 1, 10.9, 12.0),
        Foothold(2.0, -0.2, 0.3, -1, 11.5, 13.0),
    )
    found = streams.steps_of(Setpoints(10.0, PERIOD, numpy.zeros((1, 10)), feet))
    assert [round(after, 6) for after, _ in found] == [0.0, 0.9, 1.5]
    left, right = (1.0, 0.2, 0.0, 0.1), (1.0, -0.2, 0.0, 0.1)
    assert found[0][1] == (left, right)
    assert found[1][1] == ((1.6, 0.2, 0.0, 0.2), right)
    assert found[2][1] == ((1.6, 0.2, 0.0, 0.2), (2.0, -0.2, 0.0, 0.3))


def test_messages_of_a_reader_that_has_left_are_ignored() -> None:
    """A drive that ends closes its readers while robots still send."""
    heard: list[str] = []
    sent = Message(valid_data=True)
    reader = Message(take=lambda **_: [Message(sample_info=sent, text="on")])
    listener = Taking(lambda message: heard.append(message.text))
    listener.on_data_available(None)
    listener.on_data_available(reader)
    assert heard == ["on"]


@pytest.mark.parametrize(
    ("interface", "peers", "told"),
    [
        ("wlan9", (), "network interface 'wlan9'\n    this machine has lo"),
        ("lo", ("127.0.0.1:7410", "robot 1"), "'robot 1' is not the address of a robot"),
        ("lo", ("::1",), "'::1' is not the address of a robot"),
        ("lo", ("127.0.0.1:port",), "'127.0.0.1:port' is not the address of a robot"),
        ("lo", ("127.0.0.1:99999",), "ports are 1 to 65535"),
    ],
)
def test_an_unknown_network_interface_or_peer_is_refused(
    interface: str, peers: tuple[str, ...], told: str
) -> None:
    """cyclonedds ended the process for a peer whose name it did not know."""
    with pytest.raises(UsageError) as error:
        Participant(9, interface, peers)
    assert told in str(error.value)
