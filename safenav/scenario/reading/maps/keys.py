"""The keys and forms of the ``map:`` of a scenario, and its origin in metres."""

from __future__ import annotations

from typing import ClassVar

from safenav.scenario.reading.regions import PLACE
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Node, Scalar, Sequence
from safenav.scenario.yaml.fields import NAME
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.shapes import Key, Table

NO_SIZE = "map: region size missing"
"""The error of a map file that the scenario does not divide."""

FORMS: dict[str, tuple[str, ...]] = {
    "grid": ("resolution", "origin"),
    "image": ("rows", "cols", "share", "resolution", "origin"),
    "ros": ("rows", "cols", "resolution", "share"),
    "movingai": ("rows", "cols", "share", "resolution", "origin"),
}
"""The forms of a map, and the further keys that apply to each."""

OPTIONS = tuple(dict.fromkeys(key for keys in FORMS.values() for key in keys))


def _of_form(kind: str) -> shapes.Schema:
    """Return the allowed and the required keys of a form."""
    others = [other for other in OPTIONS if other not in FORMS[kind]]
    needed = {"image": ["rows"]}.get(kind, [])
    sized = {"oneOf": ({"required": ["rows"]}, {"required": ["resolution"]})}
    without = {"not": shapes.either(*({"required": [key]} for key in others))} if others else {}
    return {"required": [kind, *needed], **without, **(sized if kind == "ros" else {})}


class MapKeys(Table):
    about = "The known world: one of grid, image, ros and movingai (docs/maps.md)."
    definition = "map"
    rules: ClassVar = {
        "dependentRequired": {"rows": ["cols"], "cols": ["rows"], "origin": ["resolution"]},
        "oneOf": [_of_form(kind) for kind in FORMS],
    }
    grid = Key(
        shapes.form(
            shapes.either(
                {"type": "string", "pattern": r"^\s*[#.]+[ \t]*(\r?\n[#.]+[ \t]*)*\s*$"},
                shapes.many({"type": "string", "pattern": r"^[#.]+\s*$"}, 1),
            )
        ),
        "One line for each row: '#' is a wall, '.' is free.",
    )
    image = Key(shapes.TEXT, "A PNG or PGM file: dark is wall.")
    ros = Key(shapes.TEXT, "The YAML file of a map as ROS map_server saves it.")
    movingai = Key(shapes.TEXT, "A map of the MovingAI benchmarks.")
    rows = Key(shapes.whole(1), "Rows of regions into which the file is divided.")
    cols = Key(shapes.whole(1), "Columns of regions into which the file is divided.")
    share = Key(
        shapes.PROBABILITY, "Blocked share of a region that makes it a wall. Default: 0, any of it."
    )
    resolution = Key(shapes.POSITIVE, "Size of a region in metres.")
    origin = Key(
        shapes.form({**shapes.many({"type": "number"}, 2), "maxItems": 3}),
        "[x, y] or [x, y, yaw] of the south-western corner, in metres, radians.",
    )
    names = Key(shapes.form(shapes.named(PLACE, shapes.matching(NAME))), "Names for regions.")


def read_origin(
    node: Node | None, what: str, findings: Findings
) -> tuple[float, float, float] | None:
    """Return x, y (metres) and yaw (radians) from ``[x, y]`` or ``[x, y, yaw]``; None if missing or
    reported."""
    if not isinstance(node, Sequence) or len(node.items) not in (2, 3):
        read.wrong_type(node, what, "[x, y] or [x, y, yaw]", findings)
        return None
    for item in node.items:
        if isinstance(item, Scalar) and str(item.value).lower().strip("+-.") == "nan":
            hint = "write 0: map_saver writes nan or -nan where SLAM gave no valid rotation"
            findings.add(
                item, f"an item of {what}: found the text '{item.value}', expected a number", hint
            )
            return None
    numbers = [read.finite(item, f"an item of {what}", findings) for item in node.items]
    x, y, yaw = (*numbers, 0.0)[:3]
    return None if x is None or y is None or yaw is None else (x, y, yaw)
