"""Writes a motion as JSON Lines."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from math import ceil, log10

from safenav.motion.file.records import (
    VERSION,
    Action,
    Arc,
    Blow,
    Curve,
    Drive,
    Flight,
    FlownTrack,
    Foothold,
    Line,
    Link,
    Motion,
    Numbers,
    PressurePhase,
    Release,
    Reserve,
    Segment,
    Swing,
    Wait,
)

TYPES: Mapping[str, type[Line]] = {
    "segment": Segment,
    "flight": Flight,
    "drive": Drive,
    "track": FlownTrack,
    "push": Blow,
    "reserve": Reserve,
    "release": Release,
    "action": Action,
    "wait": Wait,
}
NAMES = {kind: name for name, kind in TYPES.items()}

DECIMALS = 12
"""Decimals of metres, seconds and radians: joins are exact to 1e-9."""

ROW = (PressurePhase, Foothold, Swing, Curve, Arc, Link)
"""Written as arrays of their fields, in order."""

RENAMED = {"origin": "from"}


def text_of(motion: Motion) -> str:
    """The lines of the file."""
    header = motion.header
    lines: list[dict[str, object]] = [{"type": "header", "motion": VERSION, **_object(header, {})}]
    lines += [{"type": NAMES[type(line)], **_object(line, RENAMED)} for line in motion.lines]
    lines.append({"type": "outcome", **_object(motion.outcome, {})})
    return "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines)


def _object(record: object, renamed: Mapping[str, str]) -> dict[str, object]:
    assert is_dataclass(record)
    return {
        renamed.get(field.name, field.name): _plain(getattr(record, field.name))
        for field in fields(record)
    }


def _plain(value: object) -> object:
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0  # no -0.0
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Curve):
        polynomials = (value.x, value.y, value.z, value.yaw)
        return [_plain(value.seconds), *(_polynomial(p, value.seconds) for p in polynomials)]
    if isinstance(value, Arc):
        pose = _plain((value.x, value.y, value.yaw, value.curvature))
        assert isinstance(pose, list)
        return [_plain(value.seconds), *pose, _polynomial(value.way, value.seconds)]
    if is_dataclass(value):
        assert isinstance(value, ROW)
        return [_plain(getattr(value, field.name)) for field in fields(value)]
    return value


def _polynomial(coefficients: Numbers, seconds: float) -> list[float]:
    """With more decimals for higher powers: at the end each adds the same error."""
    more = log10(max(seconds, 1.0))
    return [round(c, DECIMALS + ceil(k * more)) + 0.0 for k, c in enumerate(coefficients)]
