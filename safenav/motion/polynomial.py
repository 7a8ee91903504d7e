"""Polynomials in time, lowest power first: quintics between states at rest or in motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from safenav.pace.robot import PEAK as PEAK

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
    """The six coefficients of the quintic between two positions, speeds and accelerations."""
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
    """The quintics of all axes between states of positions, velocities, accelerations, each as
    many as there are axes."""
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
    """The polynomial at a time, or at several."""
    total = times * 0.0
    for coefficient in reversed(coefficients):
        total = total * times + coefficient
    return total


def derivative(coefficients: Sequence[float], order: int = 1) -> tuple[float, ...]:
    """The coefficients of a derivative; a constant has the derivative 0."""
    for _ in range(order):
        coefficients = tuple(k * c for k, c in enumerate(coefficients))[1:]
    return tuple(coefficients) or (0.0,)
