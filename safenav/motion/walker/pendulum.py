"""The linear inverted pendulum in closed form.

A centre of mass ``c`` at constant height h above flat ground, pushed by a centre of pressure ``p``,
moves by ``c'' = omega^2 (c - p)`` with ``omega = sqrt(g / h)``, in x and in y alike. Its state
splits into ``xi = c + c'/omega`` (the divergent component, or capture point) and
``eta = c - c'/omega``. While p moves linearly at the rate ``omega r``, ``xi - p - r`` grows by
``e^(omega t)`` and ``eta - p + r`` shrinks by ``e^(-omega t)``. So this module computes eta
forwards from the start and xi backwards from the goal; shooting from one side would multiply every
rounding error by e^(omega T), 10^7 over one move.

Sources: Englsberger, Ott, Albu-Schaeffer (T-RO 2015) for the divergent component; the linear
problem of a whole move is our own.

States are arrays ``[x, y, vx, vy]`` in metres and metres per second; times are seconds. The centre
of pressure of n phases is a path through n + 1 knots (n + 1, 2), linear in each phase.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def divergent(state: Array, omega: float) -> Array:
    """Return the divergent component (xi) of a state: the foothold that would bring the mass to
    rest."""
    return state[:2] + state[2:] / omega


def convergent(state: Array, omega: float) -> Array:
    """eta of a state."""
    return state[:2] - state[2:] / omega


def joined(xi: Array, eta: Array, omega: float) -> Array:
    """The state with these components; rows of states if they are rows."""
    return np.concatenate([(xi + eta) / 2, omega * (xi - eta) / 2], axis=-1)


def state_of(state: Array) -> tuple[float, float, float, float]:
    """A state as a file has it."""
    x, y, vx, vy = state.tolist()
    return x, y, vx, vy


def placed(
    durations: Array,
    nodes: Array,
    knots: NDArray[np.int64],
    start: Array,
    goal: Array,
    weights: Array,
    omega: float,
) -> Array:
    """The nodes that lead from start to goal exactly, nearest to those given.

    ``nodes`` (m, 2): feet and other points of pressure; ``knots`` (phases + 1): the node at each
    knot; ``weights`` (m): how freely each node may move; 0: fixed. At least two must be free. Two
    well-scaled equations along each axis, solved at least cost.
    """
    ends = np.cumsum(durations)
    late, early = np.exp(-omega * (ends - durations)), np.exp(-omega * (ends[-1] - ends))
    decay = np.exp(-omega * durations)
    mean = (1 - decay) / (omega * durations)
    rows = np.zeros((2, len(nodes)))
    for row, share, near, far in (
        (0, late, 1 - mean, mean - decay),
        (1, early, mean - decay, 1 - mean),
    ):
        np.add.at(rows[row], knots[:-1], share * near)
        np.add.at(rows[row], knots[1:], share * far)
    whole = np.exp(-omega * ends[-1])
    ends_at = np.array(
        [
            divergent(start, omega) - whole * divergent(goal, omega),
            convergent(goal, omega) - whole * convergent(start, omega),
        ]
    )
    spread = rows * weights
    moved: Array = nodes + spread.T @ np.linalg.solve(spread @ rows.T, ends_at - rows @ nodes)
    return moved


def advanced(state: Array, before: Array, after: Array, seconds: float, omega: float) -> Array:
    """The state after some seconds in which the centre of pressure moves from one point to another.
    For times of a step: over a whole move it would lose seven digits."""
    rate = (after - before) / (omega * seconds)
    grow, shrink = np.exp(omega * seconds), np.exp(-omega * seconds)
    xi = after + rate + (divergent(state, omega) - before - rate) * grow
    eta = after - rate + (convergent(state, omega) - before + rate) * shrink
    return joined(xi, eta, omega)


def sampled(
    durations: Array, pressures: Array, start: Array, goal: Array, times: Array, omega: float
) -> tuple[Array, Array]:
    """States (times, 4) and centres of pressure (times, 2) at times since the start.
    ``pressures``: at the knots."""
    count = len(durations)
    before, after = pressures[:-1], pressures[1:]
    rate = (after - before) / (omega * durations[:, None])
    decay = np.exp(-omega * durations)
    xi, eta = np.empty((count + 1, 2)), np.empty((count + 1, 2))
    xi[count], eta[0] = divergent(goal, omega), convergent(start, omega)
    ahead, behind = before + rate, after + rate
    for k in reversed(range(count)):
        xi[k] = ahead[k] + (xi[k + 1] - behind[k]) * decay[k]
    ahead, behind = after - rate, before - rate
    for k in range(count):
        eta[k + 1] = ahead[k] + (eta[k] - behind[k]) * decay[k]
    ends = np.cumsum(durations)
    phase = np.minimum(np.searchsorted(ends, times, side="right"), count - 1)
    since = (times - (ends - durations)[phase])[:, None]
    left = (ends[phase] - times)[:, None]
    pressure, lead = before[phase] + omega * rate[phase] * since, rate[phase]
    forward = pressure - lead + (eta[phase] - before[phase] + lead) * np.exp(-omega * since)
    backward = pressure + lead + (xi[phase + 1] - after[phase] - lead) * np.exp(-omega * left)
    return joined(backward, forward, omega), pressure
