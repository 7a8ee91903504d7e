"""Judges a walker's segments by definitions of its own: quintics by their boundary values, the
pendulum by its differential equation, distances by geometry."""

from itertools import pairwise

import numpy as np

from safenav.motion.file.records import Segment, Swing


def mass(segment: Segment, omega: float, per_phase: int = 40) -> dict[str, np.ndarray]:
    """Times, positions, velocities and centres of pressure, by the closed form of each phase:
    relative to a centre of pressure that moves linearly, the two exponentials that meet the start
    of the move (eta) and its goal (xi)."""
    start, goal = np.array(segment.start), np.array(segment.goal)
    phases = [
        (p.seconds, np.array([p.x, p.y]), np.array([p.to_x - p.x, p.to_y - p.y]) / p.seconds)
        for p in segment.phases
    ]
    eta, xi = [start[:2] - start[2:] / omega], [goal[:2] + goal[2:] / omega]
    for seconds, here, speed in phases:
        off = eta[-1] - here + speed / omega
        eta.append(here + speed * seconds - speed / omega + off * np.exp(-omega * seconds))
    for seconds, here, speed in reversed(phases):
        off = xi[0] - (here + speed * seconds) - speed / omega
        xi.insert(0, here + speed / omega + off * np.exp(-omega * seconds))
    rows: dict[str, list[np.ndarray]] = {"t": [], "c": [], "v": [], "p": []}
    begin = 0.0
    for index, (seconds, here, speed) in enumerate(phases):
        t = np.linspace(0, seconds, per_phase)[:, None]
        pressure = here + speed * t
        off = eta[index] - here + speed / omega
        forward = pressure - speed / omega + off * np.exp(-omega * t)
        off = xi[index + 1] - pressure[-1] - speed / omega
        backward = pressure + speed / omega + off * np.exp(-omega * (seconds - t))
        rows["t"].append(begin + t[:, 0])
        rows["c"].append((forward + backward) / 2)
        rows["v"].append(omega * (backward - forward) / 2)
        rows["p"].append(pressure)
        begin += seconds
    return {name: np.concatenate(parts) for name, parts in rows.items()}


def lateral_order(segment: Segment) -> float:
    """The least distance by which a foot lands on its own side of the one before."""
    least = np.inf
    for before, after in pairwise(segment.feet):
        if before.side == after.side:
            continue
        yaw = (before.yaw + after.yaw) / 2
        across = (after.x - before.x) * -np.sin(yaw) + (after.y - before.y) * np.cos(yaw)
        least = min(least, across * after.side)
    return float(least)


def longest_step(segment: Segment) -> float:
    steps = pairwise(segment.feet)
    return max((float(np.hypot(b.x - a.x, b.y - a.y)) for a, b in steps), default=0.0)


def swing_path(swing: Swing, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Positions (count, 3: x, y, yaw) and horizontal speeds: six boundary values fix a quintic."""
    seconds = swing.t1 - swing.t0
    start, goal = np.array(swing.start), np.array(swing.goal)
    powers = np.arange(6)

    def rows(t: np.ndarray, derivative: int) -> np.ndarray:
        factor = np.ones(6)
        for k in range(derivative):
            factor = factor * np.maximum(powers - k, 0)
        return factor * t[:, None] ** np.maximum(powers - derivative, 0)

    ends = np.array([0.0, seconds])
    matrix = np.stack([rows(ends, d) for d in (0, 1, 2)], axis=1).reshape(6, 6)
    values = np.array([*start.reshape(3, 3), *goal.reshape(3, 3)])
    coefficients = np.linalg.solve(matrix, values)
    times = np.linspace(0, seconds, count)
    places, speeds = (rows(times, derivative) @ coefficients for derivative in (0, 1))
    return places, np.hypot(speeds[:, 0], speeds[:, 1])


def inside(
    points: np.ndarray, segment: Segment, centre: dict[int, np.ndarray], side: float
) -> float:
    """How far inside the regions left and entered all points are; negative outside."""
    ends = np.array([centre[segment.origin], centre[segment.to]])
    low, high = ends.min(axis=0) - side / 2, ends.max(axis=0) + side / 2
    return float(min((points - low).min(), (high - points).min()))
