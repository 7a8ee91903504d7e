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

from collections.abc import Sequence
from math import exp

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.motion.file.records import PressurePhase, State

Array = NDArray[np.float64]


def divergent(state: Array, omega: float) -> Array:
    """Return the divergent component (xi) of a state: the foothold that would bring the mass to
    rest."""
    return state[:2] + state[2:] / omega


def convergent(state: Array, omega: float) -> Array:
    """eta of a state."""
    return state[:2] - state[2:] / omega


def joined(xi: Array, eta: Array, omega: float) -> Array:
    """The state with these components."""
    return np.concatenate([(xi + eta) / 2, omega * (xi - eta) / 2])


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


class Mass(Struct, frozen=True):
    """A centre of mass at some times since its start: states (n, 4) and centres of pressure (n, 2);
    ``late`` is the error of xi at the start, ``early`` that of eta at the goal."""

    times: Array
    states: Array
    pressures: Array
    late: float
    early: float


def mass(
    phases: Sequence[PressurePhase], start: State, goal: State, times: Array, omega: float
) -> Mass:
    """Solve c'' = omega^2 (c - p) with p linear in each phase: c - p obeys the equation with p = 0,
    so its growing part is computed backwards from the goal, its shrinking part forwards from the
    start. Points are complex numbers."""
    here, fast, there, slow = (
        complex(*pair) for pair in (start[:2], start[2:], goal[:2], goal[2:])
    )
    before = [complex(phase.x, phase.y) for phase in phases]
    after = [complex(phase.to_x, phase.to_y) for phase in phases]
    seconds = [phase.seconds for phase in phases]
    lead = [(b - a) / (omega * s) for a, b, s in zip(before, after, seconds, strict=True)]
    decay = [exp(-omega * s) for s in seconds]
    falling, rising = [here - fast / omega], [there + slow / omega]
    for a, b, r, shrink in zip(before, after, lead, decay, strict=True):
        falling.append(b - r + (falling[-1] - a + r) * shrink)
    for a, b, r, shrink in reversed([*zip(before, after, lead, decay, strict=True)]):
        rising.append(a + r + (rising[-1] - b - r) * shrink)
    rising.reverse()
    ends = np.cumsum(seconds)
    at = np.minimum(np.searchsorted(ends, times, side="right"), len(phases) - 1)
    begin, rate, end = np.array(before)[at], np.array(lead)[at], np.array(after)[at]
    since, left = times - (ends - seconds)[at], ends[at] - times
    pressure = begin + omega * rate * since
    fall = pressure - rate + (np.array(falling)[at] - begin + rate) * np.exp(-omega * since)
    rise = pressure + rate + (np.array(rising)[1:][at] - end - rate) * np.exp(-omega * left)
    states = np.stack([(fall + rise) / 2, omega * (rise - fall) / 2], axis=1)
    late, early = rising[0] - (here + fast / omega), falling[-1] - (there - slow / omega)
    return Mass(
        times,
        states.view(np.float64),
        pressure[:, None].view(np.float64),
        max(abs(late.real), abs(late.imag)),
        max(abs(early.real), abs(early.imag)),
    )
