"""Interface definitions of ROS 2, in its own notation, with fields in serialized order.

``interfaces.msg`` contains those of common_interfaces, rcl_interfaces and nav2_msgs (Humble and
later) that the transport and bags need.
"""

from pathlib import Path

_TEXT = Path(__file__).with_suffix(".msg").read_text(encoding="utf-8")

INTERFACES = {
    name: tuple((kind, key) for kind, key in map(str.split, fields))
    for name, *fields in (part.split("\n") for part in _TEXT.strip().split("\n\nMSG: "))
}
"""The fields (type, name) of each interface, for example ``nav_msgs/Path``, with its folder unless
that is ``msg``."""
