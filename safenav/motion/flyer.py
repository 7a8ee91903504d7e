"""Model predictive tracking of a flyer's reference at 20 Hz and its simulation.

The tracking solves a condensed quadratic programme for each axis. An axis has a position, a
velocity, and an acceleration that follows a command with a lag; the prediction error gives an
estimate of the disturbance. The tilt limit bounds the command. The corridor (the reserved regions)
bounds the body by rows with one unbounded slack: a bounded one could make the problem infeasible
and lose the drone. Source: paper, section VII (a quadratic programme at 20 Hz); Arnstroem et al.
(2022) for the solver, DAQP.

The simulated flyer is a rigid body of 0.5 kg, moved by thrust, gravity and air. An on-board
attitude loop (400 Hz) turns it so that its thrust gives the commanded acceleration. This code uses
plain numbers instead of arrays, since it runs 400 times per second of flight.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import cos, hypot, sin, sqrt

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from safenav.motion.columns import sampled
from safenav.motion.file import Flight, FlownTrack, TrackRow
from safenav.motion.geometry import MetricFloor

Array = NDArray[np.float64]

PERIOD = 0.05
"""Seconds between commands."""
HORIZON = 20
LAG = 0.1
"""Time constant in seconds with which the acceleration follows its command."""
DRAG = 0.25
"""Deceleration by the air, per speed, in 1/s."""
POSITION, VELOCITY, EFFORT, SLACK = 200.0, 10.0, 0.1, 1e5
"""Weights of the errors, of deviations from the reference's command, and of the slack."""


class AxisModel(Struct, frozen=True):
    """The discrete model of an axis with state [p, v, a, d] (``d``: a constant disturbance), and
    its programme. It predicts positions and velocities over the horizon as ``free @ state + forced
    @ commands``."""

    move: Array
    steer: Array
    gain: Array
    """Estimator gain for the measured position."""
    free: tuple[Array, Array]
    weighted: tuple[Array, Array]
    """The weighted transposes of ``forced``, which map errors to the gradient of the cost."""
    cost: Array
    rows: Array


@lru_cache(maxsize=1)
def axis_model() -> AxisModel:
    """Return the model of an axis, discretized in many small steps, with its programme."""
    parts = 50
    small = PERIOD / parts
    change = np.array([[0, 1, 0, 0], [0, -DRAG, 1, 1], [0, 0, -1 / LAG, 0], [0, 0, 0, 0]])
    push = np.array([0, 0, 1 / LAG, 0])
    once = np.eye(4) + small * change + small**2 / 2 * change @ change
    move, steer = np.eye(4), np.zeros(4)
    for _ in range(parts):
        move, steer = once @ move, once @ steer + small * push
    free, forced = np.zeros((HORIZON, 4, 4)), np.zeros((HORIZON, 4, HORIZON))
    state, effect = np.eye(4), np.zeros((4, HORIZON))
    for step in range(HORIZON):
        state, effect = move @ state, move @ effect
        effect[:, step] += steer
        free[step], forced[step] = state, effect
    position, velocity = forced[:, 0], forced[:, 1]
    weighted = POSITION * position.T, VELOCITY * velocity.T
    cost = np.zeros((HORIZON + 1, HORIZON + 1))
    cost[:-1, :-1] = weighted[0] @ position + weighted[1] @ velocity + EFFORT * np.eye(HORIZON)
    cost[-1, -1] = SLACK
    slack = np.ones((HORIZON, 1))
    rows = np.vstack([np.hstack([position, -slack]), np.hstack([position, slack])])
    gain = _estimator(move)
    return AxisModel(move, steer, gain, (free[:, 0], free[:, 1]), weighted, cost, rows)


def _estimator(move: Array) -> Array:
    """Return the steady Kalman gain for a position noise of 5 mm and disturbances d."""
    noise = np.diag([1e-8, 1e-6, 1e-4, 2e-2])
    spread, sees = np.eye(4), np.array([1.0, 0, 0, 0])
    gain = sees
    for _ in range(500):
        spread = move @ spread @ move.T + noise
        gain = spread @ sees / (sees @ spread @ sees + 0.005**2)
        spread = spread - np.outer(gain, sees @ spread)
    return gain


OPTIMAL = 1
"""The solver's flag for a solution."""
FAR = np.full(HORIZON, 1e30)
"""No bound."""


class AxisTracker:
    """Tracker of one axis. ``state``: the estimate [p, v, a, d]."""

    def __init__(self, position: float, limit: float) -> None:
        self.state = np.array([position, 0.0, 0.0, 0.0])
        self.limit = limit

    def observe(self, measured: float) -> None:
        """Correct the estimate by a measured position (metres)."""
        self.state = self.state + axis_model().gain * (measured - self.state[0])

    def command(self, wanted: Array, low: Array, high: Array) -> float:
        """Return the acceleration to command now (m/s^2) and advance the estimate by one step.

        ``wanted`` (HORIZON, 3): position, velocity, acceleration of the reference after each step;
        ``low``, ``high`` (HORIZON): bounds of the body's centre. If the solver does not finish,
        return the reference's own command.
        """
        from daqp import solve  # only simulated flights need daqp

        model = axis_model()
        position, velocity = (free @ self.state for free in model.free)
        usual = wanted[:, 2] + DRAG * wanted[:, 1] - self.state[3]
        usual = np.minimum(np.maximum(usual, -self.limit), self.limit)
        slope = np.zeros(HORIZON + 1)
        slope[:-1] = model.weighted[0] @ (position - wanted[:, 0])
        slope[:-1] += model.weighted[1] @ (velocity - wanted[:, 1])
        slope[:-1] -= EFFORT * usual
        bound = np.full(HORIZON + 1, self.limit)
        bound[-1] = 1e30
        upper = np.concatenate((bound, high - position, FAR))
        bound[-1] = 0.0
        lower = np.concatenate((-bound, -FAR, low - position))
        found, _, flag, _ = solve(model.cost.copy(), slope, model.rows.copy(), upper, lower)
        if flag != OPTIMAL:
            found = usual
        given = min(max(float(found[0]), -self.limit), self.limit)
        self.state = model.move @ self.state + model.steer * given
        return given


GRAVITY = 9.81
MASS = 0.5
RATE = 400
STEP = 1.0 / RATE
STIFFNESS, DAMPING = 22.0, 0.8
"""Attitude loop: natural frequency (rad/s) and damping ratio."""
SLOW_YAW = 0.3
"""Natural frequency of the yaw control, as a share of the attitude loop's."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Body(Struct):
    """A flying quadcopter: position, velocity, attitude (w, x, y, z, body to world), rates."""

    place: list[float]
    yaw: float
    velocity: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    rates: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    thrust: float = MASS * GRAVITY
    attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self.attitude = (cos(self.yaw / 2), 0.0, 0.0, sin(self.yaw / 2))

    @property
    def row(self) -> TrackRow:
        """The body's present state as a row of a motion file."""
        numbers = (*self.place, *self.velocity, *self.attitude, *self.rates, self.thrust)
        return tuple(round(number, DIGITS) for number in numbers)

    def advance(self, pull: Vector, yaw: float) -> None:
        """Advance by 1/400 s. Turn the body so that its thrust gives the acceleration ``pull``
        (m/s^2, without gravity) and it faces ``yaw`` (rad)."""
        w, x, y, z = self.attitude
        axis = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
        wanted = (pull[0], pull[1], pull[2] + GRAVITY)
        self.thrust = MASS * max(0.0, sum(a * b for a, b in zip(wanted, axis, strict=True)))
        self._turn(_facing(wanted, yaw))
        lift = self.thrust / MASS
        for i in range(3):
            change = lift * axis[i] - DRAG * self.velocity[i] - (GRAVITY if i == 2 else 0)
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
    """Return the attitude whose axis points along ``pull``: turned by ``yaw``, then tilted from
    upright by the shortest turn."""
    size = sqrt(pull[0] ** 2 + pull[1] ** 2 + pull[2] ** 2)
    up = pull[2] / size
    w = sqrt(max(0.0, (1 + up) / 2))
    flat = hypot(pull[0], pull[1])
    lean = sqrt(max(0.0, (1 - up) / 2)) / flat if flat > 1e-12 else 0.0
    x, y = -pull[1] * lean, pull[0] * lean
    c, s = cos(yaw / 2), sin(yaw / 2)
    return w * c, x * c + y * s, y * c - x * s, w * s


DIGITS = 6
CLIMB, SINK = 9.0, 5.0
"""Stiffness (1/s^2) and damping (1/s) of the altitude control."""


def flown(flights: Sequence[Flight], floor: MetricFloor, size: float, tilt: float) -> FlownTrack:
    """Return the simulated flight of a flyer along its flights, which have no gaps."""
    count = int((flights[-1].t1 - flights[0].t0) / PERIOD)
    sight, boxes = _reference(flights, floor, size, count + HORIZON + 1)
    altitude, yaw = sight["z"].tolist(), sight["yaw"].tolist()
    paths = [np.stack([sight[of + axis] for of in ("", "vel_", "acc_")], axis=1) for axis in "xy"]
    start = [float(path[0, 0]) for path in paths]
    body = Body([*start, altitude[0]], yaw[0])
    trackers = [AxisTracker(place, tilt) for place in start]
    rows = [body.row]
    for step in range(count):
        ahead = slice(step + 1, step + 1 + HORIZON)
        pull = []
        for i, tracker in enumerate(trackers):
            tracker.observe(body.place[i])
            pull.append(tracker.command(paths[i][ahead], boxes[ahead, i], boxes[ahead, i + 2]))
        for _ in range(round(PERIOD * RATE)):
            climb = CLIMB * (altitude[step] - body.place[2]) - SINK * body.velocity[2]
            body.advance((pull[0], pull[1], climb), yaw[step])
        rows.append(body.row)
    return FlownTrack(flights[0].robot, flights[0].t0, PERIOD, tuple(rows))


def _reference(
    flights: Sequence[Flight], floor: MetricFloor, size: float, count: int
) -> tuple[dict[str, Array], Array]:
    """Return the reference at each step of the tracking (after its end, its last position), and the
    bounds of the body's centre at that step."""
    times: Array = flights[0].t0 + PERIOD * np.arange(count, dtype=np.float64)
    boxes = np.zeros((count, 4))
    for flight in flights:
        boxes[times >= flight.t0 - 1e-12] = floor.corridor(flight.origin, flight.to, size / 2)
    return sampled(flights, times, {}), boxes
