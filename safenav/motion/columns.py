"""A robot's motion as columns of numbers at a chosen rate, in the frame of the world (with the
map's origin and yaw, as in ROS) or of the map. All robots have ``t, x, y, z, vel_{x,y,z},
acc_{x,y,z}, yaw`` of the body's centre (walkers: of the centre of mass). Walkers also have
``cop_{x,y}`` and, for each foot, ``left_{x,y,z,yaw}`` (or ``right``). A flyer in simulated flight
has its attitude ``q_{w,x,y,z}``, rates, thrust and reference instead of accelerations. The attitude
stays in the frame of the map."""

import io
from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from safenav.motion import file
from safenav.motion.geometry import between, mass, path, values
from safenav.world.map import Frame

Array = NDArray[np.float64]

BODY = ("x", "y", "z", "vel_x", "vel_y", "vel_z", "acc_x", "acc_y", "acc_z", "yaw")
WALKER = (
    *BODY,
    *("cop_x", "cop_y", "left_x", "left_y", "left_z", "left_yaw"),
    *("right_x", "right_y", "right_z", "right_yaw"),
)
TRACKED = ("q_w", "q_x", "q_y", "q_z", "omega_x", "omega_y", "omega_z", "thrust")
LEFT, RIGHT = 1, -1
_OWN_FRAME = frozenset({"q_x", "omega_x"})
_DIRECTIONS = frozenset({"vel_x", "acc_x"})


Columns = dict[str, Array]
"""Columns by name."""


def times_of(motion: file.Motion, rate: float) -> Array:
    """Return times in seconds from 0 to the end of the motion, ``rate`` per second."""
    return np.arange(0.0, motion.outcome.makespan + 0.5 / rate, 1.0 / rate)


def columns_at(motion: file.Motion, robot: str, times: Array) -> Columns:
    """Return the columns of one robot at ascending times, in the map's frame."""
    columns = sampled(motion.of(file.Moving, robot), times, motion.header.robots[robot])
    for track in motion.of(file.FlownTrack, robot):
        columns = _tracked(track, times, columns)
    return columns


def sampled(pieces: Sequence[file.Moving], times: Array, limits: Mapping[str, object]) -> Columns:
    """Return the columns of consecutive pieces at ascending times, in the map's frame."""
    names = WALKER if any(isinstance(piece, file.Segment) for piece in pieces) else BODY
    table = np.zeros((len(times), len(names)))
    begins = np.array([piece.t0 for piece in pieces])
    rows = [*np.searchsorted(times, begins - 1e-12), len(times)]
    for piece, (low, high) in zip(pieces, pairwise(rows), strict=True):
        since = np.clip(times[low:high] - piece.t0, 0.0, piece.t1 - piece.t0)
        if len(since):
            table[low:high] = sample(piece, since, limits)
    return {name: table[:, index] for index, name in enumerate(names)}


def sample(piece: file.Moving, times: Array, limits: Mapping[str, object]) -> Array:
    """Return the columns (times, names) of a piece at times since its start, in the map's frame."""
    if isinstance(piece, file.Segment):
        return _walking(piece, times, limits)
    assert isinstance(piece, file.Flight)
    ends = np.cumsum([part.seconds for part in piece.parts])
    which = np.minimum(np.searchsorted(ends, times, side="right"), len(ends) - 1)
    table = np.zeros((len(times), len(BODY)))
    for index, part in enumerate(piece.parts):
        chosen = which == index
        since = np.minimum(times[chosen] - (ends[index] - part.seconds), part.seconds)
        table[chosen] = body_rows(part, since)
    return table


def _walking(segment: file.Segment, times: Array, limits: Mapping[str, object]) -> Array:
    omega, height, clearance = (
        float(str(limits[name])) for name in ("omega", "height", "clearance")
    )
    moved = mass(segment.phases, segment.start, segment.goal, times, omega)
    table = np.zeros((len(times), len(WALKER)))
    table[:, 0:2], table[:, 2] = moved.states[:, :2], height
    table[:, 3:5] = moved.states[:, 2:]
    table[:, 6:8] = omega**2 * (moved.states[:, :2] - moved.pressures)
    table[:, 9] = body_yaw(segment, times)
    table[:, 10:12] = moved.pressures
    for side, at in ((LEFT, 12), (RIGHT, 16)):
        for foot in segment.feet:
            if foot.side == side:
                down = (times >= foot.down) & (times <= foot.up)
                table[down, at : at + 4] = (foot.x, foot.y, 0.0, foot.yaw)
        for swing in segment.swings:
            up = (times > swing.t0) & (times < swing.t1)
            if swing.side == side and up.any():
                table[up, at : at + 4] = swing_poses(swing, times[up], clearance)
    return table


def swing_poses(swing: file.Swing, times: Array, clearance: float) -> Array:
    """Return x, y, z and yaw of a foot in the air (times, 4) at times since its segment's start."""
    seconds = swing.t1 - swing.t0
    since = times - swing.t0
    x, y, yaw = (values(axis, since) for axis in between(seconds, swing.start, swing.goal))
    u = swing.u0 + (swing.u1 - swing.u0) * since / seconds
    return np.stack([x, y, 64 * clearance * u**3 * (1 - u) ** 3, yaw], axis=1)


def body_yaw(segment: file.Segment, times: Array) -> Array:
    """Return the yaw of a walker's body (a quintic step) at times since the segment's start."""
    before, after, begin, end = segment.turning
    if end <= begin:
        return np.full_like(times, after)
    u = np.clip((times - begin) / (end - begin), 0.0, 1.0)
    share: Array = u**3 * (10 - 15 * u + 6 * u**2)
    return before + (after - before) * share


def body_rows(curve: file.Curve, times: Array) -> Array:
    """Return the columns of a body (times, names) along a curve."""
    found = path(curve, times)
    return np.concatenate([found[:, :3].reshape(9, -1), found[0, 3:]]).T


def _tracked(track: file.FlownTrack, times: Array, reference: Columns) -> Columns:
    """Return the columns of a simulated flight, linear between its samples; its reference becomes
    ``ref_x``, ``ref_y``, ``ref_z``."""
    rows: Array = np.array(track.rows)
    at = track.t0 + track.step * np.arange(len(rows))
    names = ("x", "y", "z", "vel_x", "vel_y", "vel_z", *TRACKED)
    columns = {name: np.interp(times, at, rows[:, i]) for i, name in enumerate(names)}
    w, x, y, z = (columns[name] for name in TRACKED[:4])
    columns["yaw"] = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return columns | {f"ref_{name}": reference[name] for name in ("x", "y", "z")}


def placed(columns: Columns, origin: tuple[float, float, float]) -> Columns:
    """Return columns of the frame of the map, transformed to the frame of the world. ``origin``: x,
    y and yaw of the map."""
    x0, y0, yaw = origin
    found = dict(columns)
    for x in columns:
        if x.endswith("x") and x not in _OWN_FRAME:
            y, shift = f"{x[:-1]}y", (0.0, 0.0) if x in _DIRECTIONS else (x0, y0)
            found[x] = shift[0] + columns[x] * cos(yaw) - columns[y] * sin(yaw)
            found[y] = shift[1] + columns[x] * sin(yaw) + columns[y] * cos(yaw)
        elif x.endswith("yaw"):
            found[x] = columns[x] + yaw
    return found


def poses_at(
    motion: file.Motion, rate: float, frame: Frame
) -> dict[str, list[tuple[float, float, float, float]]]:
    """Return each robot's times (s) and poses (x, y in metres; yaw in radians) in a frame."""
    found, times = {}, times_of(motion, rate)
    for robot in motion.header.robots:
        there = placed(columns_at(motion, robot, times), (*frame.origin, frame.yaw))
        columns = (times, there["x"], there["y"], there["yaw"])
        found[robot] = [*zip(*(column.tolist() for column in columns), strict=True)]
    return found


def npz_bytes(motion: file.Motion, rate: float) -> bytes:
    """Return the columns of all robots as a NumPy archive: ``t``, and ``ROBOT.COLUMN`` for each."""
    times = times_of(motion, rate)
    arrays = {"t": times}
    for robot in motion.header.robots:
        found = placed(columns_at(motion, robot, times), motion.header.origin)
        arrays |= {f"{robot}.{name}": column for name, column in found.items()}
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **arrays)
    return content.getvalue()
