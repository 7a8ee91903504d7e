"""Writes a motion as JSON Lines."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, log10
from typing import Any

from safenav.lines import json_line
from safenav.motion.file.records import TYPES, VERSION, Arc, Curve, Motion, Numbers
from safenav.trace.fields import entries, is_row

NAMES = {kind: name for name, kind in TYPES.items()}

DECIMALS = 12
"""Decimals of metres, seconds and radians: joins are exact to 1e-9."""


def text_of(motion: Motion) -> str:
    """The lines of the file."""
    header = motion.header
    lines: list[dict[str, object]] = [{"type": "header", "motion": VERSION, **_object(header)}]
    lines += [{"type": NAMES[type(line)], **_object(line)} for line in motion.lines]
    lines.append({"type": "outcome", **_object(motion.outcome)})
    return "".join(map(json_line, lines))


def _object(record: object) -> dict[str, object]:
    kind: Any = type(record)
    return {entry.key: _plain(getattr(record, entry.name)) for entry in entries(kind)}


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
    kind: Any = type(value)
    if is_row(kind):
        return [_plain(getattr(value, entry.name)) for entry in entries(kind)]
    return value


def _polynomial(coefficients: Numbers, seconds: float) -> list[float]:
    """With more decimals for higher powers: at the end each adds the same error."""
    more = log10(max(seconds, 1.0))
    return [round(c, DECIMALS + ceil(k * more)) + 0.0 for k, c in enumerate(coefficients)]
