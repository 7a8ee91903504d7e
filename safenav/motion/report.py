"""A motion in words: makespan, distances, speeds and margins."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from safenav.motion.columns import Columns, columns_of
from safenav.motion.file import Action, FlownTrack, GoalLine, Motion, Moving
from safenav.motion.geometry import MetricFloor, margin

RATE = 50.0
"""Samples per second from which distances, speeds and margins are taken."""


class Travel(Struct, frozen=True):
    """Travel of a robot: metres, highest speed (m/s), and the least distance of its middle to the
    border of its reserved regions (m)."""

    metres: float
    fastest: float
    room: float


def report_of(motion: Motion) -> str:
    lines = [f"makespan {motion.outcome.makespan:.1f} s, regions of {motion.header.side:g} m"]
    lines += ["", "robot           steps s  actions s  path m   max m/s  room m"]
    for name in motion.header.robots:
        travel = travel_of(motion, name)
        pieces = [*motion.of(Moving, name), *motion.of(GoalLine, name)]
        steps = sum(piece.t1 - piece.t0 for piece in pieces if piece.origin != piece.to)
        acts = sum(action.t1 - action.t0 for action in motion.of(Action, name))
        lines.append(
            f"{name:15s} {steps:7.1f}  {acts:9.1f}  {travel.metres:6.1f}  "
            f"{travel.fastest:8.2f}  {travel.room:6.2f}"
        )
    return "\n".join([*lines, *_disturbed(motion)])


def travel_of(motion: Motion, robot: str) -> Travel:
    columns = columns_of(motion, robot, RATE, in_world=False)
    x, y = columns.place
    steps = np.hypot(np.diff(x), np.diff(y))
    speeds = np.hypot(*columns.velocity)
    return Travel(float(steps.sum()), float(speeds.max()), _room(motion, robot, columns))


def _room(motion: Motion, robot: str, columns: Columns) -> float:
    floor = MetricFloor(motion.header.rows, motion.header.cols, motion.header.side)
    x, y = columns.place
    points, least = np.column_stack([x, y]), np.inf
    for line in motion.of(Moving, robot):
        inside = (columns.times >= line.t0) & (columns.times <= line.t1)
        if inside.any():
            box = floor.corridor(line.origin, line.to)
            least = min(least, float(margin(points[inside], box).min()))
    return float(least)


def _disturbed(motion: Motion) -> list[str]:
    found: list[str] = []
    if tracks := motion.of(FlownTrack):
        errors = np.concatenate([np.array(track.errors) for track in tracks])
        rms, worst = float(np.sqrt((errors**2).mean())), float(errors.max())
        gust = motion.header.gust
        found += ["", "simulated flights" + f" in gusts of {gust:g} m/s" * bool(gust)]
        found[-1] += f": off by {rms:.3f} m (root mean square), {worst:.3f} m at most"
    return found
