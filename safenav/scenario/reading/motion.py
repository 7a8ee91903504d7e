"""Motion of a robot model: ``motion: walker``, or a mapping with its parameters."""

from __future__ import annotations

from functools import partial
from types import new_class
from typing import Any

from safenav.scenario import motion
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Mapping, Node, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import Key, Shape, Table
from safenav.world.moves import Mobility

_MODEL_KEYS = ("size", "speed")
_BESIDE = {
    **{key: f"'{key}' is a key of the robot model, beside 'motion'" for key in _MODEL_KEYS},
    "radius": "write the diameter as 'size' of the robot model, beside 'motion'",
}
KIND = "kind"


def _number(parameter: motion.Parameter) -> Shape[float]:
    """Return the shape of a numeric parameter of a kind of motion."""
    least, most = parameter.least, parameter.most
    limits = f"from {least:g} to {most:g}: {parameter.meaning}"
    reads = partial(read.within, allowed=lambda value: least <= value <= most, limits=limits)
    return Shape({"type": "number", "minimum": least, "maximum": most}, reads)


def _polygon(
    node: Node | None, what: str, findings: Findings
) -> tuple[tuple[float, float], ...] | None:
    """Return the corners, in metres, of a counter-clockwise polygon around the origin."""
    items = read.sequence(node, what, findings)
    if items is None:
        return None
    corners = []
    for item in items:
        pair = read.sequence(item, f"a corner of {what}", findings)
        if pair is None:
            return None
        numbers = [read.finite(part, f"a corner of {what}", findings) for part in pair]
        if len(numbers) != 2 or None in numbers:
            read.wrong_type(item, f"a corner of {what}", "[x, y] in metres", findings)
            return None
        corners.append((float(numbers[0] or 0), float(numbers[1] or 0)))
    shifted = corners[1:] + corners[:1]
    turns = [a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, shifted, strict=True)]
    if len(corners) < 3 or min(turns) <= 0:
        hint = "for example [[0.4, -0.2], [0.4, 0.2], [-0.3, 0.2], [-0.3, -0.2]]"
        found = f"{what} must be a polygon around the robot's centre, counter-clockwise"
        findings.add(node, found, hint)
        return None
    return tuple(corners)


_POINT = shapes.several({"type": "number"}, {"type": "number"})
_FOOTPRINT = Key(
    Shape(shapes.many(_POINT, 3), _polygon),
    "Corners in metres, x ahead and y to the left, counter-clockwise.",
    name=motion.FOOTPRINT,
)


def _table(kind: str) -> type[Table]:
    """Return the keys of a kind of motion."""
    keys: list[Key[Any]] = [
        Key(shapes.form({"const": kind}), name=KIND, required="a kind of motion")
    ]
    for name, each in (motion.parameters(kind) or {}).items():
        if name not in _MODEL_KEYS:
            about = f"{each.meaning[0].upper()}{each.meaning[1:]}. Default: {each.default:g}."
            keys.append(Key(_number(each), about, name=name))
    keys += [_FOOTPRINT] if kind in motion.WITH_FOOTPRINT else []
    return new_class(f"{kind}Keys", (Table,), {"more": keys})


_OF_A_PACKAGE = {"allOf": [shapes.TEXT, {"not": {"enum": list(motion.KINDS)}}]}
MOTION = shapes.form(
    shapes.either(
        {"anyOf": [{"enum": list(motion.KINDS)}, shapes.TEXT]},
        *map(_table, motion.KINDS),
        {"type": "object", "properties": {KIND: _OF_A_PACKAGE}, "required": [KIND]},
    ),
    "motion",
    "Its motion in metres: a kind, or a kind with its parameters.",
)


def read_motion(
    node: Node | None, model: Mapping, mobility: Mobility | None, what: str, findings: Findings
) -> motion.MotionModel | None:
    """Return the motion of a robot model; None if it has none or that was reported."""
    if node is None:
        return None
    label = f"'motion' of {what}"
    inner = node if isinstance(node, Mapping) else None
    kind = read.text(inner.get(KIND) if inner else node, label, findings)
    if inner is not None and inner.get(KIND) is None:
        findings.add(
            node, f"{label}: the key 'kind' is missing", f"known: {', '.join(motion.known_kinds())}"
        )
    if kind is None:
        return None
    known = motion.parameters(kind)
    if known is None:
        hint = suggestion(kind, motion.known_kinds())
        findings.add(node, f"{label}: unknown kind '{clipped(kind)}'", hint)
        return None
    if kind in motion.ONLY_WITH_HEADING and mobility is Mobility.FREE:
        hint = "it cannot turn around within a region: write 'mobility: heading'"
        findings.add(node, f"{label}: a {kind} moves with a heading", hint)
    for key in _MODEL_KEYS:
        if key in known:
            _number(known[key]).read(model.get(key), f"'{key}' of {what}", findings)
    item = inner and _table(kind).read(inner, label, findings, f"in {label}", _BESIDE)
    given = item.given(*item.known.values()) if item else {}
    given.pop(KIND, None)
    return motion.MotionModel(kind, tuple(given.items()))
