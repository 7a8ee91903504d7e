"""Silhouettes of the library's robots and obstacles, for pictures, pages and the studio.

Paths fit in [-1, 1] squared, y downwards, filled by the even-odd rule. A name of another model or
type finds the one that it ends in (``fire_door``: that of ``door``).
"""

from __future__ import annotations


def _disc(x: float, y: float, r: float) -> str:
    return f"M{x - r:g},{y:g}a{r:g},{r:g} 0 1 0 {2 * r:g},0a{r:g},{r:g} 0 1 0 {-2 * r:g},0Z"


def _box(x: float, y: float, to_x: float, to_y: float) -> str:
    return f"M{x:g},{y:g}H{to_x:g}V{to_y:g}H{x:g}Z"


PLATE = _disc(0, 0, 1)
"""The background of a robot's silhouette."""

_LEGS = _box(-0.34, 0.24, -0.1, 0.95) + _box(0.1, 0.24, 0.34, 0.95)
_BIPED = _disc(0, -0.72, 0.22) + _box(-0.4, -0.44, 0.4, 0.2) + _LEGS
_LEGGED = _box(-0.4, -0.35, 0.4, 0.1) + _LEGS
_QUADRUPED = "M-0.9,-0.35H0.5L0.62,-0.6H0.95V-0.2L0.7,0H-0.9Z" + "".join(
    _box(x, 0.06, x + 0.16, 0.75) for x in (-0.88, -0.56, 0.2, 0.52)
)
_WHEELS = _disc(-0.5, 0.5, 0.3) + _disc(0.5, 0.5, 0.3)
_CAR = _box(-0.9, -0.25, 0.9, 0.15) + _box(0.1, -0.6, 0.6, -0.32) + _WHEELS
_AMR = _box(-0.95, -0.2, 0.95, 0.35) + _disc(-0.6, 0.55, 0.16) + _disc(0.6, 0.55, 0.16)
_SHELF = (
    _box(-0.75, 0.3, 0.75, 0.75)
    + _box(-0.6, -0.75, 0.6, -0.55)
    + _box(-0.5, -0.5, -0.38, 0.26)
    + _box(0.38, -0.5, 0.5, 0.26)
)
_FORKLIFT = (
    "M-0.95,-0.05H-0.55V-0.7H0.05V0.45H-0.95ZM-0.4,-0.55V-0.1H-0.08V-0.55Z"
    + _box(0.15, -0.95, 0.3, 0.55)
    + _box(0.34, 0.4, 1, 0.55)
    + _disc(-0.65, 0.65, 0.22)
    + _disc(-0.1, 0.65, 0.22)
)
_BASE = _box(-0.6, 0.5, 0.6, 0.9)
_ARM = _BASE + _box(-0.4, -0.5, 0, 0.45) + _disc(-0.2, -0.75, 0.18) + _box(0.04, -0.3, 0.95, -0.12)
_MAST = _BASE + _box(-0.3, -0.9, -0.14, 0.46) + _box(-0.1, -0.35, 0.9, -0.2)
_ROTORS = (
    "M-0.6,-0.7L0,-0.1L0.6,-0.7L0.7,-0.6L0.1,0L0.7,0.6L0.6,0.7L0,0.1L-0.6,0.7L-0.7,0.6L-0.1,0"
    "L-0.7,-0.6Z"
) + "".join(_disc(x, y, 0.3) for x in (-0.68, 0.68) for y in (-0.68, 0.68))

ROBOTS = {
    "digit": _BIPED,
    "cassie": _LEGGED,
    "spot": _QUADRUPED,
    "go2": _QUADRUPED,
    "turtlebot4": _SHELF,
    "jackal": _CAR,
    "husky": _CAR,
    "mir250": _AMR,
    "forklift": _FORKLIFT,
    "fetch": _ARM,
    "stretch": _MAST,
    "quadcopter": _ROTORS,
    "crazyflie": _ROTORS,
    "bebop2": _ROTORS,
    "x500": _ROTORS,
}

_FRAME = "M-0.75,0.9V-0.9H0.75V0.9H0.6V-0.75H-0.6V0.9Z"
_LEAF = "M-0.5,-0.65L0.35,-0.45V0.9H-0.5ZM0.1,0.1A0.08,0.08 0 1 0 0.26,0.1A0.08,0.08 0 1 0 0.1,0.1Z"
_CLOUD = (
    "M-0.6,0.35A0.38,0.38 0 1 1 -0.5,-0.35A0.45,0.45 0 0 1 0.35,-0.45A0.42,0.42 0 1 1 0.6,0.35Z"
)
_STONES = ("M-0.95,0.8L-0.6,0.15L-0.15,0.8Z", "M-0.35,0.3L0,-0.4L0.4,0.3L0.1,0.75Z")

OBSTACLES = {
    "door": _FRAME + _LEAF,
    "pulled_door": _FRAME + _LEAF + "M0.42,0.1H0.9V-0.12L1.3,0.22L0.9,0.56V0.34H0.42Z",
    "sliding_door": _FRAME + _box(-0.5, -0.6, -0.08, 0.9) + _box(0.08, -0.6, 0.5, 0.9),
    "gate": "".join(_box(x, -0.8, x + 0.16, 0.9) for x in (-0.9, -0.5, 0.34, 0.74))
    + _box(-0.26, 0, 0.26, 0.5)
    + "M-0.2,-0.05V-0.25A0.2,0.2 0 0 1 0.2,-0.25V-0.05H0.1V-0.25A0.1,0.1 0 0 0 -0.1,-0.25V-0.05Z",
    "elevator": _FRAME + "M0,-0.6L0.35,-0.05H-0.35ZM0,0.75L0.35,0.2H-0.35Z",
    "debris": "".join(_STONES) + "M0.25,0.8L0.6,0.1L0.95,0.8Z",
    "spill": "M0,-0.9L0.28,-0.35A0.32,0.32 0 1 1 -0.28,-0.35Z"
    "M-0.9,0.6A0.9,0.25 0 1 1 0.9,0.6A0.9,0.25 0 1 1 -0.9,0.6Z",
    "crate": "M-0.8,-0.8H0.8V0.8H-0.8ZM-0.62,-0.62V0.62H0.62V-0.62Z"
    "M-0.62,0.45L0.45,-0.62H0.62V-0.45L-0.45,0.62H-0.62Z",
    "person": _disc(0, -0.65, 0.28) + "M-0.45,-0.3H0.45V0.35H0.28V0.95H-0.28V0.35H-0.45Z",
    "flat_battery": "M-0.85,-0.45H0.7V-0.2H0.9V0.2H0.7V0.45H-0.85ZM-0.7,-0.3V0.3H0.55V-0.3Z"
    + _box(-0.62, -0.22, -0.42, 0.22),
    "uncertainty": "M-0.5,-0.35A0.5,0.5 0 1 1 0.12,0.13V0.4H-0.14V-0.1A0.25,0.25 0 1 0 -0.24,-0.35Z"
    + _box(-0.15, 0.55, 0.13, 0.85),
    "smoke": _CLOUD + _box(-0.7, 0.5, 0.3, 0.62) + _box(-0.3, 0.75, 0.7, 0.87),
}


OBSTACLES |= dict.fromkeys(("pallet", "parcel", "medicine"), OBSTACLES["crate"])


def robot_pictogram(model: str) -> str:
    """The silhouette of a robot model; empty for one that looks like none of the library."""
    return _found(ROBOTS, model)


def obstacle_pictogram(kind: str) -> str:
    """The silhouette of an obstacle type; empty for one that looks like none of the library."""
    return _found(OBSTACLES, kind)


def _found(paths: dict[str, str], name: str) -> str:
    """The path of the longest of the names that this one is, or ends in after ``_`` or ``-``."""
    plain = name.replace("-", "_")
    fits = [known for known in paths if plain == known or plain.endswith(f"_{known}")]
    return paths[max(fits, key=len)] if fits else ""
