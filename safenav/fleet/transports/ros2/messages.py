"""ROS 2 message types as rmw_cyclonedds puts them on the wire.

Each is one interface definition of ROS 2 (common_interfaces, rcl_interfaces, nav2_msgs of Jazzy):
the type's name as DDS sees it, the fields in their order. A request or a reply of a service begins
with rmw_cyclonedds' header: the client's guid and the call's number. Bytes are plain CDR,
little-endian, which the tests compare with an independent serializer.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any

from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import final

idl: Any = types


def _message(kind: str, **fields: Any) -> Any:
    """Return the class of a message. Fields default to zero, empty, or a new message."""
    package, folder, name = kind.split("/")
    made: Any = make_idl_struct(
        name, f"{package}::{folder}::dds_::{name}_", fields, dataclassify=False
    )
    for key, of in fields.items():
        setattr(made, key, field(default_factory=partial(_default, of)))
    return dataclass(final(made))


def _default(of: Any) -> Any:
    detail = of.__metadata__[0] if hasattr(of, "__metadata__") else None
    if isinstance(detail, types.array):
        return [_default(detail.subtype) for _ in range(detail.length)]
    return [] if isinstance(detail, types.sequence) else getattr(of, "__origin__", of)()


CALL = {"client": idl.uint64, "number": idl.int64}
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Final states of a goal (action_msgs/msg/GoalStatus)."""

Time = _message("builtin_interfaces/msg/Time", sec=idl.int32, nanosec=idl.uint32)
Duration = _message("builtin_interfaces/msg/Duration", sec=idl.int32, nanosec=idl.uint32)
MessageHeader = _message("std_msgs/msg/Header", stamp=Time, frame_id=str)
String = _message("std_msgs/msg/String", data=str)
Bool = _message("std_msgs/msg/Bool", data=bool)
UUID = _message("unique_identifier_msgs/msg/UUID", uuid=idl.array[idl.uint8, 16])

Point = _message("geometry_msgs/msg/Point", x=idl.float64, y=idl.float64, z=idl.float64)
Quaternion = _message(
    "geometry_msgs/msg/Quaternion", x=idl.float64, y=idl.float64, z=idl.float64, w=idl.float64
)
PlacedPose = _message("geometry_msgs/msg/Pose", position=Point, orientation=Quaternion)
PoseStamped = _message("geometry_msgs/msg/PoseStamped", header=MessageHeader, pose=PlacedPose)
PoseWithCovariance = _message(
    "geometry_msgs/msg/PoseWithCovariance", pose=PlacedPose, covariance=idl.array[idl.float64, 36]
)
Vector3 = _message("geometry_msgs/msg/Vector3", x=idl.float64, y=idl.float64, z=idl.float64)
Twist = _message("geometry_msgs/msg/Twist", linear=Vector3, angular=Vector3)
TwistWithCovariance = _message(
    "geometry_msgs/msg/TwistWithCovariance", twist=Twist, covariance=idl.array[idl.float64, 36]
)
Transform = _message("geometry_msgs/msg/Transform", translation=Vector3, rotation=Quaternion)

Odometry = _message(
    "nav_msgs/msg/Odometry",
    header=MessageHeader,
    child_frame_id=str,
    pose=PoseWithCovariance,
    twist=TwistWithCovariance,
)
LaserScan = _message(
    "sensor_msgs/msg/LaserScan",
    header=MessageHeader,
    angle_min=idl.float32,
    angle_max=idl.float32,
    angle_increment=idl.float32,
    time_increment=idl.float32,
    scan_time=idl.float32,
    range_min=idl.float32,
    range_max=idl.float32,
    ranges=idl.sequence[idl.float32],
    intensities=idl.sequence[idl.float32],
)
MultiDOFJointTrajectoryPoint = _message(
    "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
    transforms=idl.sequence[Transform],
    velocities=idl.sequence[Twist],
    accelerations=idl.sequence[Twist],
    time_from_start=Duration,
)
Trajectory = _message(
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    header=MessageHeader,
    joint_names=idl.sequence[str],
    points=idl.sequence[MultiDOFJointTrajectoryPoint],
)

GoalInfo = _message("action_msgs/msg/GoalInfo", goal_id=UUID, stamp=Time)
CancelRequest = _message("action_msgs/srv/CancelGoal_Request", **CALL, goal_info=GoalInfo)
"""An empty id and stamp cancel every goal of the server."""
CancelReply = _message(
    "action_msgs/srv/CancelGoal_Response",
    **CALL,
    return_code=idl.int8,
    goals_canceling=idl.sequence[GoalInfo],
)

NAVIGATE = "nav2_msgs/action/NavigateToPose_"
NavigateGoal = _message(NAVIGATE + "Goal", pose=PoseStamped, behavior_tree=str)
NavigateResult = _message(NAVIGATE + "Result", error_code=idl.uint16)
NavigateFeedback = _message(
    NAVIGATE + "Feedback",
    current_pose=PoseStamped,
    navigation_time=Duration,
    estimated_time_remaining=Duration,
    number_of_recoveries=idl.int16,
    distance_remaining=idl.float32,
)
NavigateRequest = _message(NAVIGATE + "SendGoal_Request", **CALL, goal_id=UUID, goal=NavigateGoal)
NavigateReply = _message(NAVIGATE + "SendGoal_Response", **CALL, accepted=bool, stamp=Time)
ResultRequest = _message(NAVIGATE + "GetResult_Request", **CALL, goal_id=UUID)
ResultReply = _message(
    NAVIGATE + "GetResult_Response", **CALL, status=idl.int8, result=NavigateResult
)
FeedbackMessage = _message(NAVIGATE + "FeedbackMessage", goal_id=UUID, feedback=NavigateFeedback)

TriggerRequest = _message(
    "std_srvs/srv/Trigger_Request", **CALL, structure_needs_at_least_one_member=idl.uint8
)
TriggerReply = _message("std_srvs/srv/Trigger_Response", **CALL, success=bool, message=str)
