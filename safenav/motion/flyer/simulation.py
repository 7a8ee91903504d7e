"""Simulation of a flyer that tracks its references in gusty wind.

It is a rigid body of 0.5 kg, moved by its thrust, gravity and the air. An attitude loop on board
(400 Hz) turns it so that its thrust gives the commanded acceleration. Plain numbers instead of
arrays: it runs 400 times per second of flight.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from math import cos, exp, hypot, sin, sqrt

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.columns import sampled
from safenav.motion.file.records import Flight, FlownTrack
from safenav.motion.flyer.tracking import HORIZON, AxisTracker
from safenav.motion.flyer.tracking import STEP as PERIOD
from safenav.motion.geometry import MetricFloor
from safenav.pace.robot import PEAK_ACCELERATION

GRAVITY = 9.81
MASS = 0.5
DRAG = 0.25
RATE = 400
STEP = 1.0 / RATE
STIFFNESS, DAMPING = 22.0, 0.8
"""Attitude loop: natural frequency (rad/s) and damping ratio."""
SLOW_YAW = 0.3
"""Natural frequency of its yaw, as a share of the attitude loop's."""

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


Array = NDArray[np.float64]

CALM = 1.5
"""Correlation time of gusts, in seconds."""
NOISE = 0.005
"""Metres: spread of the measured position."""
STRONGEST = 2.0
"""Strongest wind that the tilt limit must withstand, over the wind's root mean square."""
ROWS = 200
"""Maximum number of samples in one line of a file."""
DIGITS = 6
CLIMB, SINK = 9.0, 5.0
"""Stiffness (1/s^2) and damping (1/s) of its altitude control."""


def check_gust(robot: str, gust: float, tilt: float, speed: float, side: float) -> None:
    """Raise UsageError for wind that the tilt limit cannot withstand beside the reference."""
    seconds = 1.875 * side / speed
    flying = min(PEAK_ACCELERATION * side / seconds**2, tilt / 2)
    need = DRAG * STRONGEST * gust + flying
    if need > tilt:
        most = (tilt - flying) / (DRAG * STRONGEST)
        raise UsageError(
            f"{robot}: gusts of {gust:g} m/s need {need:.1f} m/s^2, beyond its tilt limit of "
            f"{tilt:g} m/s^2\n    at most {most:.1f} m/s: --gust, or 'tilt' of its model"
        )


def flown(
    flights: Sequence[Flight], floor: MetricFloor, size: float, tilt: float, gust: float, seed: str
) -> list[FlownTrack]:
    """Simulate a flyer along its flights, which have no gaps, in gusts of ``gust`` m/s (root mean
    square). Deterministic by the seed."""
    count = int((flights[-1].t1 - flights[0].t0) / PERIOD + 1e-9)
    sight, boxes = _reference(flights, floor, size, count + HORIZON + 1)
    altitude, yaw = sight["z"].tolist(), sight["yaw"].tolist()
    paths = [np.stack([sight[of + axis] for of in ("", "vel_", "acc_")], axis=1) for axis in "xy"]
    chance = random.Random(seed)
    start = [float(path[0, 0]) for path in paths]
    body = Body([*start, altitude[0]], yaw[0])
    trackers = [AxisTracker(place, tilt) for place in start]
    wind = [0.0, 0.0]
    keep = exp(-STEP / CALM)
    fresh = gust * sqrt(1 - keep**2)
    rows, errors = [_row(body, wind)], [0.0]
    for step in range(count):
        ahead = slice(step + 1, step + 1 + HORIZON)
        pull = []
        for i, tracker in enumerate(trackers):
            tracker.observe(body.place[i] + chance.gauss(0, NOISE))
            pull.append(tracker.command(paths[i][ahead], boxes[ahead, i], boxes[ahead, i + 2]))
        for _ in range(round(PERIOD * RATE)):
            wind = [keep * air + fresh * chance.gauss(0, 1) for air in wind]
            climb = CLIMB * (altitude[step] - body.place[2]) - SINK * body.velocity[2]
            body.advance((pull[0], pull[1], climb), yaw[step], (wind[0], wind[1]))
        rows.append(_row(body, wind))
        off = [body.place[i] - float(path[step + 1, 0]) for i, path in enumerate(paths)]
        errors.append(round(hypot(*off), DIGITS))
    begin, robot = flights[0].t0, flights[0].robot
    return [
        FlownTrack(
            robot,
            flights[0].tick,
            begin + at * PERIOD,
            PERIOD,
            tuple(rows[at : at + ROWS]),
            tuple(errors[at : at + ROWS]),
        )
        for at in range(0, len(rows), ROWS)
    ]


def _row(body: Body, wind: Sequence[float]) -> tuple[float, ...]:
    numbers = (*body.place, *body.velocity, *body.attitude, *body.rates, body.thrust, *wind)
    return tuple(round(number, DIGITS) for number in numbers)


def _reference(
    flights: Sequence[Flight], floor: MetricFloor, size: float, count: int
) -> tuple[dict[str, Array], Array]:
    """The reference at the steps of the tracking, after its end the last position; and the box that
    the middle of the body must not leave."""
    times: Array = flights[0].t0 + PERIOD * np.arange(count, dtype=np.float64)
    boxes = np.zeros((count, 4))
    for flight in flights:
        box = floor.corridor(flight.origin, flight.to, size / 2)
        boxes[times >= flight.t0 - 1e-12] = (box.west, box.south, box.east, box.north)
    return sampled(flights, times, {}), boxes
