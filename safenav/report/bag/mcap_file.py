"""Writer of messages into an MCAP file with the ROS 2 profile (extra ``mcap``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from safenav.extras import missing
from safenav.report.bag.messages import Stamped


def write_mcap(path: Path, messages: Iterable[Stamped]) -> int:
    """Write the messages, and return their number.

    Raises UsageError if the extra is not installed.
    """
    try:
        from mcap_ros2.writer import Writer
    except ImportError:
        raise missing("an MCAP file", "mcap-ros2-support", "mcap") from None
    count = 0
    with path.open("wb") as file:
        writer = Writer(file)
        schemas = {}
        for said in messages:
            if said.kind not in schemas:
                schemas[said.kind] = writer.register_msgdef(said.kind, definition(said.kind))
            nanoseconds = round(said.seconds * 1e9)
            schema = schemas[said.kind]
            writer.write_message(said.topic, schema, said.message, nanoseconds, nanoseconds)
            count += 1
        finish: Callable[[], None] = writer.finish
        finish()
    return count


_SEPARATOR = "\n" + "=" * 80 + "\n"

_FIELDS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": ("geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"),
    "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/MapMetaData": (
        "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\n"
        "geometry_msgs/Pose origin"
    ),
    "nav_msgs/OccupancyGrid": "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data",
    "nav_msgs/Path": "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses",
    "rcl_interfaces/Log": (
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n"
        "string function\nuint32 line"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "visualization_msgs/UVCoordinate": "float32 u\nfloat32 v",
    "visualization_msgs/MeshFile": "string filename\nuint8[] data",
    "visualization_msgs/Marker": (
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
        "builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n"
        "std_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\n"
        "string text\nstring mesh_resource\nvisualization_msgs/MeshFile mesh_file\n"
        "bool mesh_use_embedded_materials"
    ),
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers",
}
"""The fields of each message, in the order of the ROS 2 interfaces (Humble and later), which is
that of the bytes."""


def definition(kind: str) -> str:
    """Return the definition of a message (``nav_msgs/msg/Path``) and of all its parts."""
    name = kind.replace("/msg/", "/")
    parts, wanted = [_FIELDS[name]], [name]
    for known in wanted:
        for line in _FIELDS[known].splitlines():
            part = line.split()[0].removesuffix("[]")
            if part in _FIELDS and part not in wanted:
                wanted.append(part)
                parts.append(f"MSG: {part}\n{_FIELDS[part]}")
    return _SEPARATOR.join(parts)
