"""The rigid body of a quadcopter: 0.5 kg that is pulled by its thrust, gravity and the air.

An attitude loop on board (400 Hz) turns it so that its thrust gives the commanded acceleration.
Plain numbers instead of arrays: it runs 400 times per second of flight.
"""

from __future__ import annotations

from math import cos, hypot, sin, sqrt

from msgspec import Struct, field

GRAVITY = 9.81
MASS = 0.5
DRAG = 0.25
RATE = 400
STEP = 1.0 / RATE
STIFFNESS, DAMPING = 22.0, 0.8
"""Attitude loop: natural frequency (rad/s) and damping ratio."""
SLOW_YAW = 0.3
"""Share of that frequency with which it turns about its own axis."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Body(Struct):
    """A quadcopter in flight: position, velocity, attitude (w, x, y, z, body to world), rates."""

    place: list[float]
    yaw: float
    velocity: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    rates: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    thrust: float = MASS * GRAVITY
    attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self.attitude = (cos(self.yaw / 2), 0.0, 0.0, sin(self.yaw / 2))

    def advance(self, pull: Vector, yaw: float, wind: tuple[float, float]) -> None:
        """One 400th of a second: turn towards the thrust that gives the acceleration ``pull``
        (m/s^2, without gravity) facing ``yaw`` (rad), in this wind (m/s)."""
        w, x, y, z = self.attitude
        axis = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
        wanted = (pull[0], pull[1], pull[2] + GRAVITY)
        self.thrust = MASS * max(0.0, sum(a * b for a, b in zip(wanted, axis, strict=True)))
        self._turn(_facing(wanted, yaw))
        lift = self.thrust / MASS
        for i, air in enumerate((wind[0], wind[1], 0.0)):
            change = lift * axis[i] - DRAG * (self.velocity[i] - air) - (GRAVITY if i == 2 else 0)
            self.place[i] += STEP * (self.velocity[i] + STEP / 2 * change)
            self.velocity[i] += STEP * change

    def _turn(self, goal: Quaternion) -> None:
        w, x, y, z = self.attitude
        a, b, c, d = goal
        error_w = w * a + x * b + y * c + z * d
        sign = 2.0 if error_w >= 0 else -2.0
        error = (
            sign * (w * b - x * a - y * d + z * c),
            sign * (w * c + x * d - y * a - z * b),
            sign * (w * d - x * c + y * b - z * a),
        )
        p, q, r = self.rates
        stiff, slow = STIFFNESS, STIFFNESS * SLOW_YAW
        # the torque is J (w^2 e - 2 zeta w rates) + rates x J rates: the inertia cancels
        self.rates[0] = p + STEP * (stiff * stiff * error[0] - 2 * DAMPING * stiff * p)
        self.rates[1] = q + STEP * (stiff * stiff * error[1] - 2 * DAMPING * stiff * q)
        self.rates[2] = r + STEP * (slow * slow * error[2] - 2 * DAMPING * slow * r)
        p, q, r = self.rates
        half = STEP / 2
        turned = (
            w - half * (x * p + y * q + z * r),
            x + half * (w * p + y * r - z * q),
            y + half * (w * q - x * r + z * p),
            z + half * (w * r + x * q - y * p),
        )
        size = sqrt(sum(part * part for part in turned))
        self.attitude = (turned[0] / size, turned[1] / size, turned[2] / size, turned[3] / size)


def _facing(pull: Vector, yaw: float) -> Quaternion:
    """The attitude whose axis points along ``pull``, turned by ``yaw`` about it: the shortest
    tilt from upright, after the yaw."""
    size = sqrt(pull[0] ** 2 + pull[1] ** 2 + pull[2] ** 2)
    up = pull[2] / size
    w = sqrt(max(0.0, (1 + up) / 2))
    flat = hypot(pull[0], pull[1])
    lean = sqrt(max(0.0, (1 - up) / 2)) / flat if flat > 1e-12 else 0.0
    x, y = -pull[1] * lean, pull[0] * lean
    c, s = cos(yaw / 2), sin(yaw / 2)
    return w * c, x * c + y * s, y * c - x * s, w * s
