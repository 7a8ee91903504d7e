"""The linear inverted pendulum in closed form, and the primitives of a walker's motion.

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

Primitives are planned once, each in its own frame: the walker enters its region at the origin,
heading along x. A *walking pose* is at apex, one step length inside, on the centre line, at the
gait's speed, the other foot in mid-air; a *standing pose* is at rest two lengths inside with both
feet on the ground. Every primitive leads exactly from one such pose to another, so primitives
compose without limit and no error accumulates: each begins at the pose of an absolute region.

Phase-space intersections give the times of the steps (safenav.pace.gait), as if the mass changed
feet in an instant. Around each such instant both feet are on the ground, and the centre of pressure
moves from one to the other at constant speed; the linear problem that places the feet knows that.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from math import cos, exp, pi, sin

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.motion.file import Foothold, FootState, PressurePhase, State, Swing
from safenav.pace.gait import Apex, Gait, Stride, starting, stopping, walking

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


LEFT, RIGHT = 1, -1

DOUBLE, LEAST_DOUBLE = 0.2, 0.16
"""Share of a step in which both feet are on the ground; of two unequal steps, of the shorter. Least
share of all steps of a move."""
SETTLING = 4
"""Phases in which the mass settles between the feet."""
SNAP = 0.5
"""A swing foot leaves the ground with this share of the acceleration of a cubic: a quintic without
acceleration there would be faster halfway."""


class Primitive(Struct, frozen=True):
    """A move in its local frame. ``start``, ``goal``: states of the mass; ``turn``: quarter turns
    to the left; ``turning``: when the body turns; ``foot``: the stance foot at the end, 0 if it
    stands."""

    name: str
    phases: tuple[PressurePhase, ...]
    start: Array
    goal: Array
    footholds: tuple[Foothold, ...]
    swings: tuple[Swing, ...]
    turn: int
    turning: tuple[float, float]
    foot: int

    @property
    def seconds(self) -> float:
        return sum(phase.seconds for phase in self.phases)


@lru_cache(maxsize=512)
def walk(gait: Gait, turn: int, foot: int) -> Primitive:
    """Walk from walking pose to walking pose of the next region, beginning on ``foot``."""
    return _stepping(f"walk {_WORDS[turn]}", gait, walking(gait, turn, foot), turn)


@lru_cache(maxsize=512)
def start(gait: Gait, turn: int, foot: int) -> Primitive:
    """Start from standing pose to walking pose of the next region; of a straight start ``foot`` is
    the stance foot at the end, of a turn the arc decides."""
    return _stepping(f"start {_WORDS[turn]}", gait, starting(gait, turn, foot), turn)


@lru_cache(maxsize=64)
def stop(gait: Gait, foot: int) -> Primitive:
    """Stop from walking pose to standing pose: a step onto the capture point, then the feet close,
    and the mass settles between them."""
    omega, offset, length = gait.omega, gait.walker.foot, gait.length
    step, close, *settling = stopping(gait)
    place, half = 2 * length, DOUBLE / 2 * min(2 * step, close)
    rest = sum(settling) / SETTLING
    durations = np.array([step - half, 2 * half, close - half, *[rest] * SETTLING])
    nodes = np.array([[length, foot * offset], [place, -foot * offset], *[[place, 0.0]] * SETTLING])
    goal = np.array([place, 0.0, 0.0, 0.0])
    begin = _walking(gait, length, foot)
    knots, weights = np.array([0, 0, 1, *range(1, SETTLING + 2)]), np.ones(SETTLING + 2)
    weights[[0, 1, -1]] = 0.0
    nodes = placed(durations, nodes, knots, begin, goal, weights, omega)
    closed, end = step + close, float(durations.sum())
    footholds = (
        Foothold(length, foot * offset, 0.0, foot, 0.0, step + half),
        Foothold(place, -foot * offset, 0.0, -foot, step - half, end),
        Foothold(place, foot * offset, 0.0, foot, closed, end),
    )
    leaving, landed, beside = footholds
    passing = _passing(gait, length, 0.0, 0.0, -foot)
    swings = (_landing(passing, landed), _swing(leaving, beside))
    phases = _phases(durations, nodes[knots])
    return Primitive("stop", phases, begin, goal, footholds, swings, 0, (0.0, 0.0), 0)


def stand(gait: Gait, seconds: float) -> Primitive:
    """Stand at rest."""
    x, offset = 2 * gait.length, gait.walker.foot
    rest = np.array([x, 0.0, 0.0, 0.0])
    feet = tuple(Foothold(x, side * offset, 0.0, side, 0.0, seconds) for side in (LEFT, RIGHT))
    phases = (PressurePhase(seconds, x, 0.0, x, 0.0),)
    return Primitive("stand", phases, rest, rest, feet, (), 0, (0.0, 0.0), 0)


def _phases(durations: Array, pressures: Array) -> tuple[PressurePhase, ...]:
    """Return the phases of a centre of pressure with these knots (phases + 1, 2)."""
    ends = pairwise(pressures.tolist())
    return tuple(
        PressurePhase(s, *a, *b) for s, (a, b) in zip(durations.tolist(), ends, strict=True)
    )


_WORDS = {0: "straight", LEFT: "left", RIGHT: "right"}


def _stepping(name: str, gait: Gait, stride: Stride, turn: int) -> Primitive:
    """Plan the steps of a stride; a standing walker first leans onto the first foot."""
    omega, offset, line = gait.omega, gait.walker.foot, stride.line
    standing = stride.lean > 0
    nodes = np.array([apex.stance(offset) for apex in line])
    weights = np.ones(len(line))
    weights[0] = weights[-1] = 0.0
    steps = np.array(stride.durations)
    switches = stride.lean + np.cumsum(steps)[:-1]
    steps[[0, -1]] *= 2  # those on the first and the last foot are half as long
    shorter = np.minimum(steps[:-1], steps[1:])
    share = max(DOUBLE, LEAST_DOUBLE * (stride.seconds - stride.lean) / float(shorter.sum()))
    half = share / 2 * shorter
    downs, ups = np.array([0.0, *(switches - half)]), np.array([*(switches + half), stride.seconds])
    times = [0.0, *np.stack([switches - half, switches + half], axis=1).ravel(), stride.seconds]
    knots = np.repeat(np.arange(len(line)), 2)
    if standing:
        middle, count = [[line[0].x, 0.0]] * 2, len(line)
        nodes, weights = np.concatenate([nodes, middle]), np.concatenate([weights, [0.0, 1.0]])
        knots = np.array([count, count + 1, *knots])
        times[1:1] = [stride.lean / 2, stride.lean]
    durations = np.diff(times)
    first, last = line[0], line[-1]
    begin = np.array([first.x, 0.0, 0.0, 0.0]) if standing else _walking(gait, first.x, first.foot)
    goal = _placed_walking(gait, last)
    nodes = placed(durations, nodes, knots, begin, goal, weights, omega)
    arc = [index for index, apex in enumerate(line) if 0 < abs(apex.yaw) < pi / 2]
    bounds = [stride.lean, *switches, stride.seconds]
    turning = (float(bounds[arc[0]]), float(bounds[arc[-1] + 2])) if arc else (0.0, 0.0)
    footholds = tuple(
        Foothold(x, y, apex.yaw, apex.foot, down, up)
        for apex, (x, y), down, up in zip(
            line, nodes[: len(line)].tolist(), downs.tolist(), ups.tolist(), strict=True
        )
    )
    if standing:  # its other foot is as far on the other side
        aside = (first.x, -first.foot * offset, 0.0, -first.foot, 0.0, stride.lean)
        footholds = (Foothold(*aside), *footholds)
    swings = _swings(gait, line, footholds, stride.seconds, standing)
    phases = _phases(durations, nodes[knots])
    return Primitive(name, phases, begin, goal, footholds, swings, turn, turning, last.foot)


def _swings(
    gait: Gait, line: Sequence[Apex], holds: tuple[Foothold, ...], end: float, standing: bool
) -> tuple[Swing, ...]:
    """Return the paths of the feet between their holds; at a walking pose a foot is half-way."""
    swings = []
    first, last, before = line[0], line[-1], holds[-2]
    if not standing:
        passing = _passing(gait, first.x, first.y, first.yaw, holds[1].side)
        swings.append(_landing(passing, holds[1]))
    swings += [_swing(*pair) for pair in zip(holds, holds[2:], strict=False)]
    passing = _passing(gait, last.x, last.y, last.yaw, before.side)
    seconds = end - before.up
    ahead = (passing[0] - before.x, passing[1] - before.y)
    leaving = _lifted(before, ahead, 3 * SNAP / seconds**2)
    swings.append(Swing(before.side, before.up, end, 0.0, 0.5, leaving, passing))
    return tuple(swings)


def _landing(passing: FootState, hold: Foothold) -> Swing:
    """Return the second half of a swing."""
    behind = (passing[0] - hold.x, passing[1] - hold.y)
    goal = _lifted(hold, behind, 3 * SNAP / hold.down**2)
    return Swing(hold.side, 0.0, hold.down, 0.5, 1.0, passing, goal)


def _swing(before: Foothold, after: Foothold) -> Swing:
    """Return a swing between two footholds."""
    ahead = (after.x - before.x, after.y - before.y)
    pull = 6 * SNAP / (after.down - before.up) ** 2
    start, goal = _lifted(before, ahead, pull), _lifted(after, ahead, -pull)
    return Swing(before.side, before.up, after.down, 0.0, 1.0, start, goal)


def _lifted(hold: Foothold, ahead: tuple[float, float], pull: float) -> FootState:
    """Return the state of a foot as it leaves or reaches the ground: at rest, accelerated along a
    way."""
    return (hold.x, hold.y, hold.yaw, 0.0, 0.0, 0.0, ahead[0] * pull, ahead[1] * pull, 0.0)


def _passing(gait: Gait, x: float, y: float, yaw: float, side: int) -> FootState:
    """The swing foot abreast of the stance foot in the periodic gait."""
    offset = side * gait.walker.foot
    speed = (1.875 - 0.375 * SNAP) * 2 * gait.length / (gait.seconds * (1 - DOUBLE))
    along = (cos(yaw), sin(yaw))
    place = (x - offset * along[1], y + offset * along[0], yaw)
    return (*place, speed * along[0], speed * along[1], 0.0, 0.0, 0.0, 0.0)


def _walking(gait: Gait, x: float, foot: int) -> Array:
    """The state of the mass at a walking pose on the centre line along x."""
    return np.array([x, foot * gait.sway, gait.speed, 0.0])


def _placed_walking(gait: Gait, apex: Apex) -> Array:
    ahead = np.array([cos(apex.yaw), sin(apex.yaw)])
    aside = np.array([-ahead[1], ahead[0]]) * apex.foot * gait.sway
    return np.concatenate([np.array([apex.x, apex.y]) + aside, ahead * gait.speed])
