"""ROS 2 message types as rmw_cyclonedds puts them on the wire.

Each class is one interface definition of ROS 2 (common_interfaces, rcl_interfaces, nav2_msgs of
Jazzy): the fields in their order, the type's name as DDS sees it. A request or a reply of a
service begins with rmw_cyclonedds' header: the client's guid and the call's number. Bytes are plain
CDR, little-endian, which the tests compare with an independent serializer.
"""

# No postponed annotations here: cyclonedds reads the types of fields when a class is made.

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import annotations as idl
from cyclonedds.idl.types import (
    array,
    float32,
    float64,
    int8,
    int16,
    int32,
    int64,
    sequence,
    uint8,
    uint16,
    uint32,
    uint64,
)

if TYPE_CHECKING:
    Doubles36 = list[float]
    Octets16 = list[int]
    Floats = list[float]
    Strings = list[str]
else:
    Doubles36 = array[float64, 36]
    Octets16 = array[uint8, 16]
    Floats = sequence[float32]
    Strings = sequence[str]


@dataclass
@idl.final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """Seconds and nanoseconds since the epoch of the sender's clock."""

    sec: int32 = 0
    nanosec: uint32 = 0

    @property
    def seconds(self) -> float:
        return float(self.sec) + float(self.nanosec) * 1e-9


@dataclass
@idl.final
class Duration(IdlStruct, typename="builtin_interfaces::msg::dds_::Duration_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
@idl.final
class MessageHeader(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
@idl.final
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str = ""


@dataclass
@idl.final
class Bool(IdlStruct, typename="std_msgs::msg::dds_::Bool_"):
    data: bool = False


@dataclass
@idl.final
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    """Metres."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@idl.final
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
@idl.final
class PlacedPose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
@idl.final
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: MessageHeader = field(default_factory=MessageHeader)
    pose: PlacedPose = field(default_factory=PlacedPose)


def _covariance() -> list[float]:
    return [0.0] * 36


@dataclass
@idl.final
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: PlacedPose = field(default_factory=PlacedPose)
    covariance: Doubles36 = field(default_factory=_covariance)


@dataclass
@idl.final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@idl.final
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
@idl.final
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist = field(default_factory=Twist)
    covariance: Doubles36 = field(default_factory=_covariance)


@dataclass
@idl.final
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: MessageHeader = field(default_factory=MessageHeader)
    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass
@idl.final
class LaserScan(IdlStruct, typename="sensor_msgs::msg::dds_::LaserScan_"):
    """Angles in radians, counter-clockwise from straight ahead; ranges in metres."""

    header: MessageHeader = field(default_factory=MessageHeader)
    angle_min: float32 = 0.0
    angle_max: float32 = 0.0
    angle_increment: float32 = 0.0
    time_increment: float32 = 0.0
    scan_time: float32 = 0.0
    range_min: float32 = 0.0
    range_max: float32 = 0.0
    ranges: Floats = field(default_factory=list)
    intensities: Floats = field(default_factory=list)


@dataclass
@idl.final
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3 = field(default_factory=Vector3)
    rotation: Quaternion = field(default_factory=Quaternion)


if TYPE_CHECKING:
    Transforms = list[Transform]
    Twists = list[Twist]
else:
    Transforms = sequence[Transform]
    Twists = sequence[Twist]


@dataclass
@idl.final
class TrajectoryPoint(
    IdlStruct, typename="trajectory_msgs::msg::dds_::MultiDOFJointTrajectoryPoint_"
):
    """Where each joint is ``time_from_start`` after the stamp of the trajectory."""

    transforms: Transforms = field(default_factory=list)
    velocities: Twists = field(default_factory=list)
    accelerations: Twists = field(default_factory=list)
    time_from_start: Duration = field(default_factory=Duration)


if TYPE_CHECKING:
    TrajectoryPoints = list[TrajectoryPoint]
else:
    TrajectoryPoints = sequence[TrajectoryPoint]


@dataclass
@idl.final
class Trajectory(IdlStruct, typename="trajectory_msgs::msg::dds_::MultiDOFJointTrajectory_"):
    header: MessageHeader = field(default_factory=MessageHeader)
    joint_names: Strings = field(default_factory=list)
    points: TrajectoryPoints = field(default_factory=list)


@dataclass
@idl.final
class UUID(IdlStruct, typename="unique_identifier_msgs::msg::dds_::UUID_"):
    uuid: Octets16 = field(default_factory=lambda: [0] * 16)


@dataclass
@idl.final
class GoalInfo(IdlStruct, typename="action_msgs::msg::dds_::GoalInfo_"):
    goal_id: UUID = field(default_factory=UUID)
    stamp: Time = field(default_factory=Time)


if TYPE_CHECKING:
    GoalInfos = list[GoalInfo]
else:
    GoalInfos = sequence[GoalInfo]


@dataclass
@idl.final
class GoalStatus(IdlStruct, typename="action_msgs::msg::dds_::GoalStatus_"):
    goal_info: GoalInfo = field(default_factory=GoalInfo)
    status: int8 = 0


if TYPE_CHECKING:
    GoalStatuses = list[GoalStatus]
else:
    GoalStatuses = sequence[GoalStatus]


@dataclass
@idl.final
class GoalStatusArray(IdlStruct, typename="action_msgs::msg::dds_::GoalStatusArray_"):
    status_list: GoalStatuses = field(default_factory=list)


SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Final states of a goal (action_msgs/msg/GoalStatus)."""


@dataclass
@idl.final
class CancelRequest(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Request_"):
    """An empty id and stamp cancel every goal of the server."""

    client: uint64
    number: int64
    goal_info: GoalInfo = field(default_factory=GoalInfo)


@dataclass
@idl.final
class CancelReply(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Response_"):
    client: uint64
    number: int64
    return_code: int8 = 0
    goals_canceling: GoalInfos = field(default_factory=list)


@dataclass
@idl.final
class NavigateGoal(IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_Goal_"):
    pose: PoseStamped = field(default_factory=PoseStamped)
    behavior_tree: str = ""


@dataclass
@idl.final
class NavigateResult(IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_Result_"):
    error_code: uint16 = 0


@dataclass
@idl.final
class NavigateFeedback(IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_Feedback_"):
    current_pose: PoseStamped = field(default_factory=PoseStamped)
    navigation_time: Duration = field(default_factory=Duration)
    estimated_time_remaining: Duration = field(default_factory=Duration)
    number_of_recoveries: int16 = 0
    distance_remaining: float32 = 0.0


@dataclass
@idl.final
class NavigateRequest(
    IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_SendGoal_Request_"
):
    client: uint64
    number: int64
    goal_id: UUID = field(default_factory=UUID)
    goal: NavigateGoal = field(default_factory=NavigateGoal)


@dataclass
@idl.final
class NavigateReply(
    IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_SendGoal_Response_"
):
    client: uint64
    number: int64
    accepted: bool = False
    stamp: Time = field(default_factory=Time)


@dataclass
@idl.final
class ResultRequest(
    IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_GetResult_Request_"
):
    client: uint64
    number: int64
    goal_id: UUID = field(default_factory=UUID)


@dataclass
@idl.final
class ResultReply(
    IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_GetResult_Response_"
):
    client: uint64
    number: int64
    status: int8 = 0
    result: NavigateResult = field(default_factory=NavigateResult)


@dataclass
@idl.final
class FeedbackMessage(
    IdlStruct, typename="nav2_msgs::action::dds_::NavigateToPose_FeedbackMessage_"
):
    goal_id: UUID = field(default_factory=UUID)
    feedback: NavigateFeedback = field(default_factory=NavigateFeedback)


@dataclass
@idl.final
class TriggerRequest(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Request_"):
    client: uint64
    number: int64
    structure_needs_at_least_one_member: uint8 = 0


@dataclass
@idl.final
class TriggerReply(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    client: uint64
    number: int64
    success: bool = False
    message: str = ""
