"""Kinds of motion of robot models, with their parameters (docs/motion.md).

Built-in kinds are listed here; a model sets ``size`` and ``speed``. ``safenav.motion`` implements
them; this module never imports it.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct


class Parameter(Struct, frozen=True):
    """A number that a kind of motion takes: its default, its bounds, and what it means."""

    default: float
    least: float
    most: float
    meaning: str


ACTION = Parameter(2.0, 0.0, 3600.0, "duration of an action in seconds")

KINDS: Mapping[str, Mapping[str, Parameter]] = {
    "walker": {
        "size": Parameter(0.6, 0.1, 2.0, "diameter of its body in metres"),
        "speed": Parameter(0.45, 0.05, 2.0, "maximum speed of each foot in metres per second"),
        "height": Parameter(0.8, 0.3, 1.5, "height of the centre of mass in metres"),
        "foot": Parameter(0.18, 0.1, 0.4, "metres from the centre line to each foot"),
        "clearance": Parameter(0.12, 0.02, 0.3, "foot clearance in metres"),
        "action_seconds": ACTION,
    },
    "flyer": {
        "size": Parameter(0.5, 0.05, 5.0, "diameter of its body in metres"),
        "speed": Parameter(1.0, 0.05, 20.0, "maximum speed in metres per second"),
        "altitude": Parameter(2.2, 0.1, 100.0, "metres above the ground"),
        "tilt": Parameter(3.4, 0.5, 8.0, "maximum horizontal acceleration in m/s^2"),
        "action_seconds": ACTION,
    },
    "rover": {
        "size": Parameter(0.6, 0.05, 5.0, "diameter of its body in metres"),
        "speed": Parameter(0.8, 0.05, 10.0, "maximum speed in metres per second"),
        "acceleration": Parameter(0.5, 0.05, 10.0, "maximum acceleration in m/s^2"),
        "turning": Parameter(1.0, 0.05, 10.0, "maximum turning rate in radians per second"),
        "action_seconds": ACTION,
    },
    "disc": {
        "size": Parameter(0.5, 0.01, 10.0, "diameter in metres"),
        "speed": Parameter(0.5, 0.01, 20.0, "maximum speed in metres per second"),
        "action_seconds": ACTION,
    },
}
"""Parameters of the built-in kinds by name. ``size`` and ``speed`` are keys of the model."""

AIR = "air"
"""The layer of robots that fly unless their model says otherwise."""

ONLY_WITH_HEADING = frozenset({"walker"})
TURNING = "rover"
"""The kind of motion that turns within a region."""


def resolved(
    motion: str | None, size: float | None, speed: float | None, layer: str
) -> dict[str, object] | None:
    """Return a model's kind of motion with all its parameters: its size and speed, and defaults.

    Without ``motion``, a model of the layer ``air`` flies if its size and speed allow that, and any
    other with a speed moves as a disc. None if it has neither.
    """
    if motion is None and layer == AIR and _within("flyer", size=size, speed=speed):
        motion = "flyer"
    if motion is None:
        if speed is None:
            return None
        motion = "disc"
    known = KINDS.get(motion, {})
    values: dict[str, object] = {name: parameter.default for name, parameter in known.items()}
    values.update((name, own) for name, own in (("size", size), ("speed", speed)) if own)
    return {"kind": motion, **values}


def _within(kind: str, **values: float | None) -> bool:
    """Return whether a built-in kind takes these values."""
    known = KINDS[kind]
    return all(v is None or known[n].least <= v <= known[n].most for n, v in values.items())
