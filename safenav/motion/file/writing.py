"""Writes a motion as JSON Lines."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

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
    if is_dataclass(value):
        assert isinstance(value, ROW)
        return [_plain(getattr(value, field.name)) for field in fields(value)]
    return value
