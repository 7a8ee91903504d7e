"""Silhouettes of the library's robots and obstacles, for pictures, pages and the studio.

Paths fit in [-1, 1] squared, y downwards, filled by the even-odd rule. Another model or type has
the silhouette of the known name at its end (``fire_door``: that of ``door``).
"""

from __future__ import annotations

from itertools import pairwise
from math import hypot


def _disc(x: float, y: float, r: float) -> str:
    return f"M{x - r:g},{y:g}a{r:g},{r:g} 0 1 0 {2 * r:g},0a{r:g},{r:g} 0 1 0 {-2 * r:g},0Z"


def _box(x: float, y: float, to_x: float, to_y: float) -> str:
    return f"M{x:g},{y:g}H{to_x:g}V{to_y:g}H{x:g}Z"


PLATE = _disc(0, 0, 1)
"""The background of a robot's silhouette."""


def _line(width: float, *points: tuple[float, float]) -> str:
    """Return a stroke along points as one outline; overlapping strokes would leave holes."""
    left: list[tuple[float, float]] = []
    right: list[tuple[float, float]] = []
    ways = []
    for (x, y), (to_x, to_y) in pairwise(points):
        length = hypot(to_x - x, to_y - y)
        ways.append(((to_x - x) / length, (to_y - y) / length))
    for i, (x, y) in enumerate(points):
        before, after = ways[max(0, i - 1)], ways[min(i, len(ways) - 1)]
        # The mitre of two edges, at half the width from both.
        share = width / 2 / (1 + before[0] * after[0] + before[1] * after[1])
        dx, dy = -(before[1] + after[1]) * share, (before[0] + after[0]) * share
        left.append((x + dx, y + dy))
        right.append((x - dx, y - dy))
    return "M" + "L".join(f"{x:.2f},{y:.2f}" for x, y in left + right[::-1]) + "Z"


def _bird_leg(x: float, top: float) -> str:
    """Return a leg of a Cassie or Digit, with a joint that bends backwards."""
    high = 0.92 - top
    return _line(
        0.17,
        (x, top),
        (x + 0.2, top + 0.3 * high),
        (x - 0.22, top + 0.62 * high),
        (x, 0.88),
        (x + 0.28, 0.88),
    )


def _dog_legs(*places: float) -> str:
    return "".join(_line(0.14, (x, 0.16), (x - 0.16, 0.46), (x + 0.04, 0.88)) for x in places)


_DIGIT = (
    _box(-0.2, -1, 0.18, -0.72)
    + "M-0.36,-0.66H0.26L0.18,-0.05H-0.3Z"
    + _line(0.15, (0.36, -0.52), (0.46, -0.1), (0.92, -0.22))
    + _bird_leg(-0.34, 0.02)
    + _bird_leg(0.16, 0.02)
)
_CASSIE = _box(-0.5, -0.85, 0.44, -0.4) + _bird_leg(-0.36, -0.32) + _bird_leg(0.22, -0.32)
_SPOT = (
    _box(-0.92, -0.22, 0.92, 0.1)
    + _dog_legs(-0.74, -0.34, 0.44, 0.84)
    + _line(0.13, (0.42, -0.28), (-0.1, -0.66), (0.66, -0.78), (0.9, -0.55))
)
_GO2 = (
    "M-0.86,-0.3H0.36L0.5,-0.5H0.92L0.96,-0.16L0.64,0.1H-0.86Z"
    "M0.66,-0.38V-0.24H0.84V-0.38Z" + _dog_legs(-0.68, -0.34, 0.24, 0.56)
)
_JACKAL = (
    "M-0.8,-0.1L-0.66,-0.4H0.66L0.8,-0.1V0.14H-0.8Z"
    + _box(-0.06, -0.72, 0.06, -0.44)
    + _box(-0.2, -0.94, 0.2, -0.74)
    + _disc(-0.5, 0.52, 0.34)
    + _disc(0.5, 0.52, 0.34)
)
_HUSKY = (
    _box(-0.8, -0.32, 0.84, -0.16)
    + _line(0.12, (-0.62, -0.36), (-0.62, -0.86), (0.12, -0.86), (0.12, -0.36))
    + "M-0.92,-0.12H0.98V0.4L0.88,0.12H-0.92Z"
    + _disc(-0.52, 0.52, 0.38)
    + _disc(0.46, 0.52, 0.38)
)
_AMR = (
    "M-0.95,-0.1A0.2,0.2 0 0 1 -0.75,-0.3H0.75A0.2,0.2 0 0 1 0.95,-0.1V0.45H-0.95Z"
    "M-0.8,0.02V0.14H0.8V0.02Z" + "".join(_box(x, 0.48, x + 0.22, 0.62) for x in (-0.72, 0.5))
)
_SHELF = (
    "M-0.8,0.5A0.26,0.26 0 0 1 -0.54,0.24H0.54A0.26,0.26 0 0 1 0.8,0.5V0.82H-0.8Z"
    + _box(-0.2, -0.02, 0.2, 0.2)
    + _box(-0.62, -0.62, 0.62, -0.44)
    + _box(-0.16, -0.9, 0.16, -0.66)
    + _box(-0.54, -0.4, -0.42, 0.22)
    + _box(0.42, -0.4, 0.54, 0.22)
)
_FORKLIFT = (
    "M-0.95,-0.05H-0.55V-0.7H0.05V0.45H-0.95ZM-0.4,-0.55V-0.1H-0.08V-0.55Z"
    + _box(0.15, -0.95, 0.3, 0.55)
    + _box(0.34, 0.4, 1, 0.55)
    + _disc(-0.65, 0.65, 0.22)
    + _disc(-0.1, 0.65, 0.22)
)
_FETCH = (
    "M-0.72,0.5L-0.6,0.34H0.5L0.62,0.5V0.92H-0.72Z"
    + _box(-0.36, -0.52, 0, 0.3)
    + _box(-0.46, -0.92, 0.16, -0.6)
    + _line(0.15, (0.04, -0.36), (0.5, -0.36), (0.72, 0.04))
    + "M0.56,0.12H0.96V0.34H0.86V0.22H0.66V0.34H0.56Z"
)
_STRETCH = (
    "M-0.62,0.58H0.5V0.8H-0.62Z"
    + _disc(-0.42, 0.9, 0.1)
    + _disc(0.3, 0.9, 0.1)
    + _box(-0.4, -0.68, -0.24, 0.54)
    + _box(-0.46, -0.98, -0.08, -0.72)
    + _box(-0.2, -0.22, 0.7, -0.06)
    + "M0.72,-0.3H0.98V-0.2H0.82V-0.08H0.98V0.02H0.72Z"
)


def _rotors(arm: float, rotor: float, hub: str, *, rings: bool) -> str:
    """Return four rotors seen from above, on arms from a hub."""
    far = 0.98 - rotor
    found = hub
    for x in (-1, 1):
        for y in (-1, 1):
            near = far - 0.71 * rotor - 0.03
            found += _line(arm, (0.22 * x, 0.22 * y), (near * x, near * y))
            found += _disc(far * x, far * y, rotor)
            if rings:
                found += _disc(far * x, far * y, rotor * 0.72) + _disc(
                    far * x, far * y, rotor * 0.2
                )
    return found


_QUADCOPTER = _rotors(0.14, 0.34, _disc(0, 0, 0.2), rings=True)
_CRAZYFLIE = _rotors(0.09, 0.2, "M-0.2,-0.4H0.2V0.4H-0.2Z", rings=False)
_BEBOP = _rotors(0.12, 0.38, "M-0.16,-0.2L0,-0.98L0.16,-0.2V0.62H-0.16Z", rings=False)
_X500 = (
    "".join(
        _box(x - 0.4, -0.62, x + 0.4, -0.5) + _box(x - 0.07, -0.46, x + 0.07, -0.28)
        for x in (-0.58, 0.58)
    )
    + _box(-0.8, -0.24, 0.8, -0.1)
    + _box(-0.3, -0.06, 0.3, 0.2)
    + _line(0.12, (-0.34, -0.06), (-0.56, 0.7))
    + _line(0.12, (0.34, -0.06), (0.56, 0.7))
    + _box(-0.86, 0.74, -0.3, 0.86)
    + _box(0.3, 0.74, 0.86, 0.86)
)

ROBOTS = {
    "digit": _DIGIT,
    "cassie": _CASSIE,
    "spot": _SPOT,
    "go2": _GO2,
    "turtlebot4": _SHELF,
    "jackal": _JACKAL,
    "husky": _HUSKY,
    "mir250": _AMR,
    "forklift": _FORKLIFT,
    "fetch": _FETCH,
    "stretch": _STRETCH,
    "quadcopter": _QUADCOPTER,
    "crazyflie": _CRAZYFLIE,
    "bebop2": _BEBOP,
    "x500": _X500,
}

_FRAME = "M-0.75,0.9V-0.9H0.75V0.9H0.6V-0.75H-0.6V0.9Z"
_LEAF = "M-0.5,-0.65L0.35,-0.45V0.9H-0.5ZM0.1,0.1A0.08,0.08 0 1 0 0.26,0.1A0.08,0.08 0 1 0 0.1,0.1Z"
_CLOUD = (
    "M-0.6,0.35A0.38,0.38 0 1 1 -0.5,-0.35A0.45,0.45 0 0 1 0.35,-0.45A0.42,0.42 0 1 1 0.6,0.35Z"
)
_STONES = ("M-0.95,0.8L-0.6,0.15L-0.15,0.8Z", "M-0.35,0.3L0,-0.4L0.4,0.3L0.1,0.75Z")

OBSTACLES = {
    "door": _FRAME + _LEAF,
    "pulled_door": "M-1,0.9V-0.9H0.3V0.9H0.15V-0.75H-0.85V0.9Z"
    "M-0.78,-0.65L-0.08,-0.45V0.9H-0.78Z"
    + _disc(-0.22, 0.1, 0.08)
    + "M0.38,0.08H0.62V-0.2L1,0.2L0.62,0.6V0.32H0.38Z",
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
    "pallet": _box(-0.7, -0.8, -0.05, -0.15)
    + _box(0.05, -0.8, 0.7, -0.15)
    + _box(-0.7, -0.08, 0.7, 0.34)
    + _box(-0.95, 0.42, 0.95, 0.58)
    + "".join(_box(x, 0.58, x + 0.24, 0.8) for x in (-0.95, -0.12, 0.71))
    + _box(-0.95, 0.8, 0.95, 0.92),
    "parcel": "M0,-0.95L0.85,-0.5L0,-0.05L-0.85,-0.5ZM-0.85,-0.36L-0.06,0.06V0.96L-0.85,0.52Z"
    "M0.85,-0.36L0.06,0.06V0.96L0.85,0.52Z",
    "medicine": "M-0.9,-0.5H-0.4V-0.85H0.4V-0.5H0.9V0.8H-0.9ZM-0.25,-0.5H0.25V-0.7H-0.25Z"
    "M-0.14,-0.3V0H-0.44V0.28H-0.14V0.58H0.14V0.28H0.44V0H0.14V-0.3Z",
    "person": _disc(0, -0.65, 0.28) + "M-0.45,-0.3H0.45V0.35H0.28V0.95H-0.28V0.35H-0.45Z",
    "flat_battery": "M-0.85,-0.45H0.7V-0.2H0.9V0.2H0.7V0.45H-0.85ZM-0.7,-0.3V0.3H0.55V-0.3Z"
    + _box(-0.62, -0.22, -0.42, 0.22),
    "uncertainty": "M-0.5,-0.35A0.5,0.5 0 1 1 0.12,0.13V0.4H-0.14V-0.1A0.25,0.25 0 1 0 -0.24,-0.35Z"
    + _box(-0.15, 0.55, 0.13, 0.85),
    "smoke": _CLOUD + _box(-0.7, 0.5, 0.3, 0.62) + _box(-0.3, 0.75, 0.7, 0.87),
}


CHARGER = "M0.25,-1L-0.6,0.15H-0.05L-0.25,1L0.6,-0.2H0.08Z"
"""The mark of a region where batteries are charged."""


def robot_pictogram(model: str) -> str:
    """Return the silhouette of a robot model; empty if none fits."""
    return _found(ROBOTS, model)


def obstacle_pictogram(kind: str) -> str:
    """Return the silhouette of an obstacle type; empty if none fits."""
    return _found(OBSTACLES, kind)


def _found(paths: dict[str, str], name: str) -> str:
    """Return the path of the longest known name that equals ``name``, or ends it after ``_`` or
    ``-``; empty if there is none."""
    plain = name.replace("-", "_")
    fits = [known for known in paths if plain == known or plain.endswith(f"_{known}")]
    return paths[max(fits, key=len)] if fits else ""
