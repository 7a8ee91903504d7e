"""The prismatic inverted pendulum in closed form.

A centre of mass ``c`` at constant height h above flat ground, pushed by a centre of pressure ``p``,
moves by ``c'' = omega^2 (c - p)`` with ``omega = sqrt(g / h)``, in x and in y alike. Its state
splits into ``xi = c + c'/omega`` (the divergent component, or capture point) and
``eta = c - c'/omega``: forwards in time eta contracts towards p, backwards in time xi does. So this
module computes eta forwards from the start and xi backwards from the goal; shooting from one side
would multiply every rounding error by e^(omega T), 10^7 over one move.

Sources: Englsberger, Ott, Albu-Schaeffer (T-RO 2015) for the divergent component; the linear
problem of a whole move is our own.

States are arrays ``[x, y, vx, vy]`` in metres and metres per second; times are seconds.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
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


def advanced(state: Array, pressure: Array, seconds: float, omega: float) -> Array:
    """The state after some seconds over a constant centre of pressure. For times of a step:
    over a whole move it would lose seven digits."""
    grow, shrink = np.exp(omega * seconds), np.exp(-omega * seconds)
    xi = pressure + (divergent(state, omega) - pressure) * grow
    eta = pressure + (convergent(state, omega) - pressure) * shrink
    return joined(xi, eta, omega)


class Influence(Struct, frozen=True):
    """The effect of the centres of pressure of some phases on both ends of a move, along each axis:
    ``xi(start) = diverging @ p + late * xi(goal)``, ``eta(goal) = converging @ p + early *
    eta(start)``. The same for x and y."""

    diverging: Array
    converging: Array
    decay: float
    """e^(-omega T), both ``late`` and ``early``."""


def influence(durations: Array, omega: float) -> Influence:
    """The influence of phases of these durations, in seconds."""
    ends = np.cumsum(durations)
    share = 1 - np.exp(-omega * durations)
    diverging = share * np.exp(-omega * (ends - durations))
    converging = share * np.exp(-omega * (ends[-1] - ends))
    return Influence(diverging, converging, float(np.exp(-omega * ends[-1])))


def miss(
    durations: Array, pressures: Array, start: Array, goal: Array, omega: float
) -> tuple[Array, Influence]:
    """Return the residual of the phases: rows xi at the start and eta at the goal, and the
    influence.

    ``pressures``: (phases, 2). The result times the influence of a correction must vanish.
    """
    effect = influence(durations, omega)
    xi = divergent(start, omega) - effect.decay * divergent(goal, omega)
    eta = convergent(goal, omega) - effect.decay * convergent(start, omega)
    wanted = np.array([xi - effect.diverging @ pressures, eta - effect.converging @ pressures])
    return wanted, effect


def placed(
    durations: Array, pressures: Array, start: Array, goal: Array, weights: Array, omega: float
) -> Array:
    """The centres of pressure that lead from start to goal exactly, nearest to those given.

    ``weights`` (phases): how freely each may move; 0: fixed. At least two must be free. Two
    well-scaled equations along each axis, solved at least cost.
    """
    wanted, effect = miss(durations, pressures, start, goal, omega)
    rows = np.array([effect.diverging, effect.converging])
    spread = rows * weights
    moved: Array = pressures + spread.T @ np.linalg.solve(spread @ rows.T, wanted)
    return moved


def knots(
    durations: Array, pressures: Array, start: Array, goal: Array, omega: float
) -> tuple[Array, Array]:
    """xi and eta at the beginning of each phase and at the end: two arrays (phases + 1, 2)."""
    count = len(durations)
    decay = np.exp(-omega * durations)
    xi, eta = np.empty((count + 1, 2)), np.empty((count + 1, 2))
    xi[count], eta[0] = divergent(goal, omega), convergent(start, omega)
    for phase in range(count):
        eta[phase + 1] = pressures[phase] + (eta[phase] - pressures[phase]) * decay[phase]
    for phase in reversed(range(count)):
        xi[phase] = pressures[phase] + (xi[phase + 1] - pressures[phase]) * decay[phase]
    return xi, eta


def sampled(
    durations: Array, pressures: Array, start: Array, goal: Array, times: Array, omega: float
) -> tuple[Array, Array]:
    """States (times, 4) and centres of pressure (times, 2) at times since the start."""
    xi, eta = knots(durations, pressures, start, goal, omega)
    ends = np.cumsum(durations)
    phase = np.minimum(np.searchsorted(ends, times, side="right"), len(durations) - 1)
    pressure = pressures[phase]
    since = (times - (ends - durations)[phase])[:, None]
    left = (ends[phase] - times)[:, None]
    forward = pressure + (eta[phase] - pressure) * np.exp(-omega * since)
    backward = pressure + (xi[phase + 1] - pressure) * np.exp(-omega * left)
    return joined(backward, forward, omega), pressure
