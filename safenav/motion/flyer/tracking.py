"""Model predictive tracking at 20 Hz along one axis: a condensed quadratic programme.

The axis has position, velocity and acceleration, which follows a command with a lag; a disturbance
is estimated from the prediction error. The command is bounded by the tilt limit. The corridor (the
reserved regions) bounds the body by rows with one unbounded slack: a bounded one could make the
problem infeasible, and lose the drone. Source: paper, section VII (a quadratic programme at 20 Hz);
Arnstroem et al. (2022) for the solver, DAQP.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.extras import missing

Array = NDArray[np.float64]

STEP = 0.05
"""Seconds between commands."""
HORIZON = 20
LAG = 0.1
"""Seconds in which the acceleration follows its command."""
DRAG = 0.25
"""Deceleration by the air in 1/s of the speed through it."""
POSITION, VELOCITY, EFFORT, SLACK = 200.0, 10.0, 0.1, 1e5
"""Weights of the errors, of the command off the reference's, and of leaving the corridor."""


class Axis(Struct, frozen=True):
    """Discrete model of one axis: state [p, v, a, d], ``d`` a constant disturbance."""

    move: Array
    steer: Array
    gain: Array
    """Estimator gain for the measured position."""


class Programme(Struct, frozen=True):
    """The condensed programme: predictions are ``free @ state + forced @ commands``; ``weighted``
    are the transposed ``forced``, which turn errors into the slope of the cost."""

    free_position: Array
    free_velocity: Array
    weighted_position: Array
    weighted_velocity: Array
    cost: Array
    rows: Array


@lru_cache(maxsize=1)
def axis() -> Axis:
    """The model, discretized exactly enough by many small steps, and its estimator."""
    parts = 50
    small = STEP / parts
    change = np.array([[0, 1, 0, 0], [0, -DRAG, 1, 1], [0, 0, -1 / LAG, 0], [0, 0, 0, 0]])
    push = np.array([0, 0, 1 / LAG, 0])
    once = np.eye(4) + small * change + small**2 / 2 * change @ change
    move, steer = np.eye(4), np.zeros(4)
    for _ in range(parts):
        move, steer = once @ move, once @ steer + small * push
    return Axis(move, steer, _estimator(move))


def _estimator(move: Array) -> Array:
    """The steady gain of a Kalman filter: noise of 5 mm on the position, gusts on d."""
    noise = np.diag([1e-8, 1e-6, 1e-4, 2e-2])
    spread, sees = np.eye(4), np.array([1.0, 0, 0, 0])
    gain = sees
    for _ in range(500):
        spread = move @ spread @ move.T + noise
        gain = spread @ sees / (sees @ spread @ sees + 0.005**2)
        spread = spread - np.outer(gain, sees @ spread)
    return gain


@lru_cache(maxsize=1)
def programme() -> Programme:
    """The programme of the whole horizon, made once."""
    model = axis()
    free = np.zeros((HORIZON, 4, 4))
    forced = np.zeros((HORIZON, 4, HORIZON))
    state, effect = np.eye(4), np.zeros((4, HORIZON))
    for step in range(HORIZON):
        state, effect = model.move @ state, model.move @ effect
        effect[:, step] += model.steer
        free[step], forced[step] = state, effect
    position, velocity = forced[:, 0], forced[:, 1]
    cost = np.zeros((HORIZON + 1, HORIZON + 1))
    cost[:-1, :-1] = POSITION * position.T @ position + VELOCITY * velocity.T @ velocity
    cost[:-1, :-1] += EFFORT * np.eye(HORIZON)
    cost[-1, -1] = SLACK
    slack = np.ones((HORIZON, 1))
    rows = np.vstack([np.hstack([position, -slack]), np.hstack([position, slack])])
    weighted = POSITION * position.T, VELOCITY * velocity.T
    return Programme(free[:, 0], free[:, 1], *weighted, cost, rows)


OPTIMAL = 1
"""The solver's flag of a solution."""
FAR = np.full(HORIZON, 1e30)
"""No bound."""


@lru_cache(maxsize=1)
def _solver() -> Callable[..., tuple[Array, float, int, object]]:
    """The solver of quadratic programmes; it is loaded on first use."""
    try:
        from daqp import solve
    except ImportError as error:
        raise missing("the tracking of flights", "daqp", "motion") from error
    found: Callable[..., tuple[Array, float, int, object]] = solve
    return found


class AxisTracker:
    """Tracks one axis. ``state`` is the estimate [p, v, a, d]; ``failed`` counts programmes that
    the solver did not finish, in which case the reference's own command is given."""

    def __init__(self, position: float, limit: float) -> None:
        self.state = np.array([position, 0.0, 0.0, 0.0])
        self.limit = limit
        self.failed = 0

    def observe(self, measured: float) -> None:
        """Correct the estimate by a measured position (m)."""
        self.state = self.state + axis().gain * (measured - self.state[0])

    def command(self, wanted: Array, low: Array, high: Array) -> float:
        """The acceleration to command now (m/s^2), and the estimate one step on.

        ``wanted`` (HORIZON, 3): position, velocity, acceleration of the reference after each
        step; ``low``, ``high`` (HORIZON): where the middle of the body may be.
        """
        plan = programme()
        position = plan.free_position @ self.state
        velocity = plan.free_velocity @ self.state
        usual = wanted[:, 2] + DRAG * wanted[:, 1] - self.state[3]
        usual = np.minimum(np.maximum(usual, -self.limit), self.limit)
        slope = np.zeros(HORIZON + 1)
        slope[:-1] = plan.weighted_position @ (position - wanted[:, 0])
        slope[:-1] += plan.weighted_velocity @ (velocity - wanted[:, 1])
        slope[:-1] -= EFFORT * usual
        bound = np.full(HORIZON + 1, self.limit)
        bound[-1] = 1e30
        upper = np.concatenate((bound, high - position, FAR))
        bound[-1] = 0.0
        lower = np.concatenate((-bound, -FAR, low - position))
        found, _, flag, _ = _solver()(plan.cost.copy(), slope, plan.rows.copy(), upper, lower)
        if flag != OPTIMAL:
            self.failed += 1
            found = usual
        given = min(max(float(found[0]), -self.limit), self.limit)
        model = axis()
        self.state = model.move @ self.state + model.steer * given
        return given
