"""Waypoints with times and speeds: where each robot is at the end of each move, from its motion.

In the frame of the world, as ROS has it: metres, seconds since the start, radians.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from math import cos, hypot, remainder, sin, tau

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, astuple

from safenav.lines import csv_text
from safenav.motion.columns import sample
from safenav.motion.file.records import GoalLine, Motion, Moving, Piece, Segment


class TimedWaypoint(Struct, frozen=True):
    """``speed``: metres per second as it passes there, 0 where it comes to rest."""

    robot: str
    tick: int
    t: float
    x: float
    y: float
    z: float
    yaw: float
    speed: float
    region: int


def timed_waypoints(motion: Motion) -> list[TimedWaypoint]:
    """The waypoints of all robots, one robot after the other: the start, and the end of each piece
    of motion that moves the robot or brings it to rest."""
    found = []
    for robot in motion.header.robots:
        pieces = motion.of(Moving, robot)
        goals = motion.of(GoalLine, robot)
        found += [_reached(motion, goal) for goal in goals if goal.end == "succeeded"]
        if pieces:
            found.append(_at(motion, pieces[0], 0.0, pieces[0].origin))
        ends = [p for p in pieces if p.origin != p.to or p.primitive in ("stop", "turn")]
        found += [_at(motion, piece, piece.t1 - piece.t0, piece.to) for piece in ends]
    return found


def _at(motion: Motion, piece: Moving, since: float, region: int) -> TimedWaypoint:
    row = sample(piece, np.array([since]), motion.header.robots[piece.robot])[0].tolist()
    yaw = row[11] if isinstance(piece, Segment) else row[9]
    pose = (row[0], row[1], row[2], yaw, hypot(row[3], row[4]))
    return _waypoint(motion, piece, piece.t0 + since, pose, region)


def _reached(motion: Motion, goal: GoalLine) -> TimedWaypoint:
    """Return the pose in which a goal was reached; a goal without a heading faces east."""
    height = motion.header.robots[goal.robot].get("altitude", 0.0)
    z = float(height) if isinstance(height, int | float) else 0.0
    return _waypoint(motion, goal, goal.t1, (goal.x, goal.y, z, goal.yaw or 0.0, 0.0), goal.to)


def _waypoint(
    motion: Motion, piece: Piece, t: float, pose: tuple[float, ...], region: int
) -> TimedWaypoint:
    """A waypoint in the world, from x, y, z, yaw and speed in the frame of the map."""
    x0, y0, turned = motion.header.origin
    x = x0 + pose[0] * cos(turned) - pose[1] * sin(turned)
    y = y0 + pose[0] * sin(turned) + pose[1] * cos(turned)
    numbers = (t, x, y, pose[2], remainder(pose[3] + turned, tau), pose[4])
    t, x, y, z, yaw, speed = (round(number, 6) + 0.0 for number in numbers)
    return TimedWaypoint(piece.robot, piece.tick, t, x, y, z, yaw, speed, region)


def as_csv(found: Iterable[TimedWaypoint]) -> str:
    """A line for each waypoint, below a line of headings."""
    return csv_text(TimedWaypoint.__struct_fields__, map(astuple, found))


def as_json(found: Iterable[TimedWaypoint]) -> str:
    """The waypoints of each robot."""
    robots: dict[str, list[dict[str, object]]] = {}
    for waypoint in map(asdict, found):
        robots.setdefault(waypoint.pop("robot"), []).append(waypoint)
    return json.dumps({"robots": robots}, indent=1) + "\n"
