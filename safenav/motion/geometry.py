"""Geometry of motions: regions in metres, headings, polynomials in time (lowest power first), and
the mass of a linear inverted pendulum.

The frame of a motion: x east, y north, origin at the south-western corner of the map, metres,
radians counter-clockwise from east.
"""

from collections.abc import Sequence
from math import exp
from typing import TypeVar

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple, replace
from numpy.typing import NDArray

from safenav.motion.file import Curve, Foothold, FootState, PressurePhase, Segment, State
from safenav.pace.robot import PEAK as PEAK
from safenav.world.map import HEADINGS, Heading

Array = NDArray[np.float64]
T = TypeVar("T", float, Array)


def quintic(
    seconds: float,
    start: float,
    speed: float,
    goal: float,
    goal_speed: float,
    pull: float = 0.0,
    goal_pull: float = 0.0,
) -> tuple[float, ...]:
    """Return the six coefficients of the quintic from a position, speed and acceleration (``pull``)
    to those of the goal."""
    distance = goal - start
    v0, v1 = speed * seconds, goal_speed * seconds
    a0, a1 = pull * seconds**2 / 2, goal_pull * seconds**2 / 2
    third = 10 * distance - 6 * v0 - 4 * v1 - 3 * a0 + a1
    fourth = -15 * distance + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1
    fifth = 6 * distance - 3 * v0 - 3 * v1 - a0 + a1
    shape = (start, v0, a0, third, fourth, fifth)
    return tuple(value / seconds**power for power, value in enumerate(shape))


def between(
    seconds: float, start: Sequence[float], goal: Sequence[float]
) -> tuple[tuple[float, ...], ...]:
    """Return the quintics of all axes between two states. A state lists the positions of all axes,
    then their velocities, then their accelerations."""
    count = len(start) // 3
    return tuple(
        quintic(
            seconds,
            start[i],
            start[i + count],
            goal[i],
            goal[i + count],
            start[i + 2 * count],
            goal[i + 2 * count],
        )
        for i in range(count)
    )


def values(coefficients: Sequence[float], times: T) -> T:
    """Return the value of a polynomial at a time or its values at several times."""
    total = times * 0.0
    for coefficient in reversed(coefficients):
        total = total * times + coefficient
    return total


def slope(coefficients: Sequence[float], time: float) -> tuple[float, float]:
    """Return the value of a polynomial and of its derivative at a time."""
    value = rate = 0.0
    for coefficient in reversed(coefficients):
        rate = rate * time + value
        value = value * time + coefficient
    return value, rate


def path(curve: Curve, times: Array) -> Array:
    """Return positions, velocities and accelerations (3, 4, times) of x, y, z, yaw along a
    curve."""
    axes = (curve.x, curve.y, curve.z, curve.yaw)
    table = np.zeros((4, max(1, *map(len, axes))))
    for row, axis in zip(table, axes, strict=True):
        row[: len(axis)] = axis
    powers = np.vander(times, table.shape[1], increasing=True).T
    found = np.zeros((3, 4, len(times)))
    for order in range(3):
        found[order] = table @ powers[: table.shape[1]]
        table = table[:, 1:] * np.arange(1, table.shape[1])
    return found


class MetricFloor(Struct, frozen=True):
    """A map of square regions of ``side`` metres, numbered in reading order."""

    rows: int
    cols: int
    side: float

    def centre(self, region: int) -> tuple[float, float]:
        row, col = divmod(region, self.cols)
        return (col + 0.5) * self.side, (self.rows - row - 0.5) * self.side

    def corridor(
        self, one: int, other: int, inset: float = 0.0
    ) -> tuple[float, float, float, float]:
        """Return the western, southern, eastern and northern border (metres) of two regions (or of
        one, if both are the same), moved inwards by ``inset``."""
        (ax, ay), (bx, by) = self.centre(one), self.centre(other)
        half = self.side / 2 - inset
        return min(ax, bx) - half, min(ay, by) - half, max(ax, bx) + half, max(ay, by) + half

    def heading(self, origin: int, to: int) -> str:
        """Return the heading of a step between two adjacent regions."""
        (row, col), (next_row, next_col) = divmod(origin, self.cols), divmod(to, self.cols)
        step = (next_row - row, next_col - col)
        return next(heading.label for heading in Heading if heading.step == step)


def turn(before: str, after: str) -> int:
    """Return the quarter turns counter-clockwise between two headings: -1, 0, 1 or 2."""
    quarters = (HEADINGS[before] - HEADINGS[after]) % 4
    return quarters - 4 if quarters == 3 else quarters


def unit_vector(heading: str) -> tuple[int, int]:
    """Return a heading as an integer unit vector, which makes rotations exact."""
    row, col = HEADINGS[heading].step
    return col, -row


class Mass(Struct, frozen=True):
    """A centre of mass at some times since its start: states (n, 4) and centres of pressure (n, 2).
    ``late``: the error of xi at the start; ``early``: that of eta at the goal."""

    times: Array
    states: Array
    pressures: Array
    late: float
    early: float


def mass(
    phases: Sequence[PressurePhase], start: State, goal: State, times: Array, omega: float
) -> Mass:
    """Return the solution of c'' = omega^2 (c - p) with p linear in each phase. c - p obeys the
    equation with p = 0, so its growing part is computed backwards from the goal, and its shrinking
    part forwards from the start. Points are complex numbers."""
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


def transformed(segment: Segment, origin: complex, ahead: complex, facing: float) -> Segment:
    """Return a segment in another frame, where the segment's frame has this ``origin`` and its x
    points ``ahead``. ``facing``: the angle of ``ahead``. Points are complex numbers."""

    def way(x: float, y: float) -> tuple[float, float]:
        found = ahead * complex(x, y)
        return found.real, found.imag

    def point(x: float, y: float) -> tuple[float, float]:
        found = origin + ahead * complex(x, y)
        return found.real, found.imag

    def foot(state: FootState) -> FootState:
        x, y, yaw, vx, vy, turning, ax, ay, bending = state
        return *point(x, y), yaw + facing, *way(vx, vy), turning, *way(ax, ay), bending

    def moving(state: State) -> State:
        x, y, vx, vy = state
        return *point(x, y), *way(vx, vy)

    before, after, begin, end = segment.turning
    return replace(
        segment,
        phases=tuple(
            PressurePhase(one.seconds, *point(one.x, one.y), *point(one.to_x, one.to_y))
            for one in segment.phases
        ),
        feet=tuple(
            Foothold(*point(x, y), yaw + facing, *rest)
            for x, y, yaw, *rest in map(astuple, segment.feet)
        ),
        swings=tuple(
            replace(swing, start=foot(swing.start), goal=foot(swing.goal))
            for swing in segment.swings
        ),
        turning=(before + facing, after + facing, begin, end),
        start=moving(segment.start),
        goal=moving(segment.goal),
    )
