"""ROS 2 message types as rmw_cyclonedds puts them on the wire.

Each is one interface: the type's name as DDS sees it, the fields in their order. A request or a
reply of a service begins with rmw_cyclonedds' header: the client's guid and the call's number.
Bytes are plain CDR, little-endian, which the tests compare with an independent serializer.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import final

from safenav.fleet.ros2.interfaces import INTERFACES

idl: Any = types


@cache
def _message(kind: str) -> Any:
    """Return the class of a message. Fields default to zero, empty, or a new message."""
    package, *folder, name = kind.split("/")
    fields: dict[str, Any] = {}
    if name.endswith(("_Request", "_Response")):
        fields = {"client": idl.uint64, "number": idl.int64}
    fields |= {key: _type(of) for of, key in map(str.split, INTERFACES[kind])}
    on_the_wire = f"{package}::{folder[0] if folder else 'msg'}::dds_::{name}_"
    made: Any = make_idl_struct(name, on_the_wire, fields, dataclassify=False)
    for key, of in fields.items():
        setattr(made, key, field(default_factory=partial(_default, of)))
    return dataclass(final(made))


def _type(of: str) -> Any:
    """Return the type of a field: ``float64``, ``float64[36]``, ``geometry_msgs/Pose[]``."""
    base, bracket, count = of.removesuffix("]").partition("[")
    plain = {"string": str, "bool": bool}
    inner = _message(base) if "/" in base else plain.get(base) or getattr(idl, base)
    if not bracket:
        return inner
    return idl.array[inner, int(count)] if count else idl.sequence[inner]


def _default(of: Any) -> Any:
    detail = of.__metadata__[0] if hasattr(of, "__metadata__") else None
    if isinstance(detail, types.array):
        return [_default(detail.subtype) for _ in range(detail.length)]
    return [] if isinstance(detail, types.sequence) else getattr(of, "__origin__", of)()


SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Final states of a goal (action_msgs/msg/GoalStatus)."""

Time = _message("builtin_interfaces/Time")
Duration = _message("builtin_interfaces/Duration")
MessageHeader = _message("std_msgs/Header")
String = _message("std_msgs/String")
Bool = _message("std_msgs/Bool")
UUID = _message("unique_identifier_msgs/UUID")

Point = _message("geometry_msgs/Point")
Quaternion = _message("geometry_msgs/Quaternion")
PlacedPose = _message("geometry_msgs/Pose")
PoseStamped = _message("geometry_msgs/PoseStamped")
Vector3 = _message("geometry_msgs/Vector3")
Twist = _message("geometry_msgs/Twist")
Transform = _message("geometry_msgs/Transform")
PoseWithCovariance = _message("geometry_msgs/PoseWithCovariance")
TwistWithCovariance = _message("geometry_msgs/TwistWithCovariance")
TransformStamped = _message("geometry_msgs/TransformStamped")
TFMessage = _message("tf2_msgs/TFMessage")
Odometry = _message("nav_msgs/Odometry")
LaserScan = _message("sensor_msgs/LaserScan")
MultiDOFJointTrajectoryPoint = _message("trajectory_msgs/MultiDOFJointTrajectoryPoint")
Trajectory = _message("trajectory_msgs/MultiDOFJointTrajectory")

GoalInfo = _message("action_msgs/GoalInfo")
CancelRequest = _message("action_msgs/srv/CancelGoal_Request")
"""An empty id and stamp cancel every goal of the server."""
CancelReply = _message("action_msgs/srv/CancelGoal_Response")

NAVIGATE = "nav2_msgs/action/NavigateToPose_"
NavigateGoal = _message(NAVIGATE + "Goal")
NavigateResult = _message(NAVIGATE + "Result")
NavigateFeedback = _message(NAVIGATE + "Feedback")
NavigateRequest = _message(NAVIGATE + "SendGoal_Request")
NavigateReply = _message(NAVIGATE + "SendGoal_Response")
ResultRequest = _message(NAVIGATE + "GetResult_Request")
ResultReply = _message(NAVIGATE + "GetResult_Response")
FeedbackMessage = _message(NAVIGATE + "FeedbackMessage")

TriggerRequest = _message("std_srvs/srv/Trigger_Request")
TriggerReply = _message("std_srvs/srv/Trigger_Response")
