"""The ``origin`` of a map: where its lower left corner lies, in metres and radians."""

from __future__ import annotations

from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node, Sequence
from safenav.scenario.yaml.fields import wrong_type
from safenav.scenario.yaml.findings import Findings


def read_origin(
    node: Node | None, what: str, findings: Findings
) -> tuple[float, float, float] | None:
    """``[x, y]`` or ``[x, y, yaw]``."""
    if node is None:
        return None
    if not isinstance(node, Sequence) or len(node.items) not in (2, 3):
        wrong_type(node, what, "[x, y] or [x, y, yaw]", findings)
        return None
    numbers = [read.finite(item, f"an item of {what}", findings) for item in node.items]
    x, y, yaw = (*numbers, 0.0)[:3]
    return None if x is None or y is None or yaw is None else (x, y, yaw)
