"""The bytes of ROS 2 messages, against an independent serializer with definitions of its own."""

import importlib
import math
import random
import re
from functools import cache
from importlib.util import find_spec
from typing import Any

import pytest

from safenav.fleet.ros2.interfaces import INTERFACES

pytestmark = pytest.mark.skipif(
    find_spec("cyclonedds") is None, reason="the ROS 2 transport needs the extra 'ros2'"
)

NAVIGATE = "nav2_msgs/msg/NavigateToPose_"
DEFINITIONS = {
    "Goal": "geometry_msgs/PoseStamped pose\nstring behavior_tree\n",
    "Result": "uint16 error_code\n",
    "Feedback": """geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining
""",
    "SendGoal_Request": f"unique_identifier_msgs/UUID goal_id\n{NAVIGATE}Goal goal\n",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp\n",
    "GetResult_Request": "unique_identifier_msgs/UUID goal_id\n",
    "GetResult_Response": f"int8 status\n{NAVIGATE}Result result\n",
    "FeedbackMessage": f"unique_identifier_msgs/UUID goal_id\n{NAVIGATE}Feedback feedback\n",
}
SERVICES = {
    "action_msgs/msg/CancelGoal_Request": "action_msgs/GoalInfo goal_info\n",
    "action_msgs/msg/CancelGoal_Response": (
        "int8 return_code\naction_msgs/GoalInfo[] goals_canceling\n"
    ),
    "std_srvs/msg/Trigger_Response": "bool success\nstring message\n",
    "std_srvs/msg/Trigger_Request": "uint8 structure_needs_at_least_one_member\n",
}
KINDS = {
    "std_msgs/msg/String": "String",
    "std_msgs/msg/Bool": "Bool",
    "nav_msgs/msg/Odometry": "Odometry",
    "tf2_msgs/msg/TFMessage": "TFMessage",
    "sensor_msgs/msg/LaserScan": "LaserScan",
    "trajectory_msgs/msg/MultiDOFJointTrajectory": "Trajectory",
    "action_msgs/msg/CancelGoal_Request": "CancelRequest",
    "action_msgs/msg/CancelGoal_Response": "CancelReply",
    "std_srvs/msg/Trigger_Request": "TriggerRequest",
    "std_srvs/msg/Trigger_Response": "TriggerReply",
    f"{NAVIGATE}Goal": "NavigateGoal",
    f"{NAVIGATE}Result": "NavigateResult",
    f"{NAVIGATE}Feedback": "NavigateFeedback",
    f"{NAVIGATE}SendGoal_Request": "NavigateRequest",
    f"{NAVIGATE}SendGoal_Response": "NavigateReply",
    f"{NAVIGATE}GetResult_Request": "ResultRequest",
    f"{NAVIGATE}GetResult_Response": "ResultReply",
    f"{NAVIGATE}FeedbackMessage": "FeedbackMessage",
}


def kind_of(name: str) -> Any:
    """A kind of messages of ours. Imported late: it takes as long as collecting 200 tests."""
    return getattr(importlib.import_module("safenav.fleet.ros2.node"), name)


@cache
def typestore() -> Any:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    texts = {f"{NAVIGATE}{name}": text for name, text in DEFINITIONS.items()} | SERVICES
    for name, text in texts.items():
        store.register(get_types_from_msg(text, name))
    return store


def drawn(name: str, rng: random.Random) -> Any:
    """A random value of a type, by the serializer's own description of it."""
    store = typestore()
    fields = store.fielddefs[name][1]
    return store.types[name](**{field: _drawn(what, rng) for field, what in fields})


INTEGERS = {f"{sign}int{bits}": (sign, bits) for sign in ("u", "") for bits in (8, 16, 32, 64)}


def _drawn(what: Any, rng: random.Random) -> Any:
    import numpy

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
    value = rng.choice((0.0, -0.0, math.inf, rng.uniform(-1e6, 1e6), rng.random()))
    if name == "float32":
        import numpy

        return float(numpy.float32(value))
    return value


def named(what: Any) -> str:
    """A type of the other library in our notation, without folders."""
    shape, detail = what
    if shape.name in ("BASE", "NAME"):
        return re.sub("/(msg|srv|action)/", "/", detail if shape.name == "NAME" else detail[0])
    return f"{named(detail[0])}[{detail[1] or ''}]"


def test_fields_are_those_of_other_definitions() -> None:
    """In their order and with their signs, which the bytes alone do not show."""
    for name, fields in INTERFACES.items():
        package, *_, kind = name.split("/")
        theirs = typestore().fielddefs[f"{package}/msg/{kind}"][1]
        mine = [re.sub("/(msg|srv|action)/", "/", field) for field in fields]
        assert mine == [f"{named(what)} {field}" for field, what in theirs], name


@pytest.mark.parametrize("name", KINDS, ids=lambda name: name.split("/")[-1])
def test_bytes_are_those_of_another_serializer(name: str, values: int = 200) -> None:
    """A request or reply begins with its header, after which CDR restarts its count by 8."""
    rng = random.Random(name)
    kind = kind_of(KINDS[name])
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
