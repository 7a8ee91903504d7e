"""The size of regions and the origin of a map in metres."""

from __future__ import annotations

from safenav.scenario.yaml.document import Node, Scalar, Sequence
from safenav.scenario.yaml.fields import wrong_type
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.typed import read

NO_SIZE = "map: region size missing"
"""The error of a map file that the scenario does not divide."""


def read_origin(
    node: Node | None, what: str, findings: Findings
) -> tuple[float, float, float] | None:
    """Return x, y (metres) and yaw (radians) from ``[x, y]`` or ``[x, y, yaw]``; None if missing or
    reported."""
    if not isinstance(node, Sequence) or len(node.items) not in (2, 3):
        wrong_type(node, what, "[x, y] or [x, y, yaw]", findings)
        return None
    for item in node.items:
        if isinstance(item, Scalar) and str(item.value).lower().strip("+-.") == "nan":
            hint = "write 0: map_saver writes nan or -nan where SLAM gave no valid rotation"
            findings.add(
                item, f"an item of {what}: found the text '{item.value}', expected a number", hint
            )
            return None
    numbers = [read(float, item, f"an item of {what}", findings) for item in node.items]
    x, y, yaw = (*numbers, 0.0)[:3]
    return None if x is None or y is None or yaw is None else (x, y, yaw)
