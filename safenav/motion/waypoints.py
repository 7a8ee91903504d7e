"""Runs as waypoints in metres, for a robot stack.

A waypoint is the position of a robot at the end of a tick (in a live run: of each of its steps).
With the motion of a run, it is the position at the end of each piece that leads to another region,
turns the robot or stops it. Its frame is that of ROS map_server: x grows east, y grows north, the
origin is the south-western corner (docs/maps.md); metres, seconds since the start, radians.
"""

import csv
import io
from collections.abc import Iterator, Sequence
from math import hypot, remainder, tau

from msgspec import Struct
from msgspec.structs import astuple, replace

from safenav.errors import UsageError
from safenav.motion.file import Motion, Moving
from safenav.pace.robot import YAW
from safenav.run.run import Run
from safenav.trace.file import Trace
from safenav.world.map import Frame

_DECIMALS = 6


class Waypoint(Struct, frozen=True):
    """A position. ``tick``: the tick (live: the moment) at whose end the robot is there, 0 for the
    start; ``t``: seconds, in a run with a clock or a motion; ``yaw``: None for a robot without a
    heading. A motion also gives the height ``z`` and the ``speed`` of the robot there, 0 at
    rest."""

    robot: str
    tick: int
    t: float | None
    x: float
    y: float
    z: float | None
    yaw: float | None
    speed: float | None
    region: int


def frame_of(trace: Trace, resolution: float | None = None) -> Frame:
    """Return the frame of the trace's map; ``resolution`` (metres) replaces its own.

    Raises UsageError if the size of a region is missing.
    """
    own = trace.header.scenario.map.frame
    side = own.resolution if resolution is None and own is not None else resolution
    if side is None:
        raise UsageError(
            f"{trace.source}: the size of a region in metres is missing\n"
            "    add --side 0.5, or 'resolution' to the map of the scenario"
        )
    return Frame(side) if own is None else replace(own, resolution=side)


def waypoints(run: Run, frame: Frame) -> list[Waypoint]:
    """Return the waypoints of all robots, sorted by robot."""
    found: list[Waypoint] = []
    for track in run.robots:
        before = None
        for tick, pose in enumerate(zip(track.regions, track.headings, strict=True)):
            if run.seconds is not None and pose == before:
                continue  # an event of another robot
            before = region, facing = pose
            centre = frame.centre(*run.map.position(region), run.map.rows)
            x, y = (round(value, _DECIMALS) for value in centre)
            yaw = None
            if facing is not None:
                yaw = round(remainder(YAW[facing.label] + frame.yaw, tau), _DECIMALS)
            t = None if run.seconds is None else round(run.seconds[tick], _DECIMALS)
            found.append(Waypoint(track.name, tick, t, x, y, None, yaw, None, region))
    return found


def timed_waypoints(motion: Motion) -> list[Waypoint]:
    """Return the waypoints of a motion: each robot's start, and the end of each piece that leads it
    to another region, turns it or stops it."""
    x0, y0, turned = motion.header.origin
    frame = Frame(motion.header.side, (x0, y0), turned)

    def placed(piece: Moving, t: float, pose: Sequence[float], region: int) -> Waypoint:
        x, y = frame.in_world(pose[0], pose[1])
        tick = piece.tick if t > piece.t0 else 0
        numbers = (t, x, y, pose[2], remainder(pose[3] + turned, tau), pose[4])
        t, x, y, z, yaw, speed = (round(number, _DECIMALS) + 0.0 for number in numbers)
        return Waypoint(piece.robot, tick, t, x, y, z, yaw, speed, region)

    found = []
    for robot in motion.header.robots:
        for piece, since, region in _ends(motion.of(Moving, robot)):
            found.append(placed(piece, piece.t0 + since, _pose(motion, piece, since), region))
    return found


def _ends(pieces: Sequence[Moving]) -> Iterator[tuple[Moving, float, int]]:
    """Yield, for each waypoint, a piece of motion, the seconds since its start, and the region."""
    if pieces:
        yield pieces[0], 0.0, pieces[0].origin
    for piece in pieces:
        if piece.origin != piece.to or piece.primitive in ("stop", "turn"):
            yield piece, piece.t1 - piece.t0, piece.to


def _pose(motion: Motion, piece: Moving, since: float) -> tuple[float, ...]:
    """Return x, y, z, yaw and speed in the frame of the map at a time since a piece's start."""
    import numpy as np

    from safenav.motion.columns import sample  # waypoints of a trace need no numpy

    row = sample(piece, np.array([since]), motion.header.robots[piece.robot])[0].tolist()
    return row[0], row[1], row[2], row[9], hypot(row[3], row[4])


def as_csv(found: Sequence[Waypoint]) -> str:
    """Return the waypoints as CSV (RFC 4180, with line feeds) with a line of column names. Unknown
    fields are empty."""
    text = io.StringIO()
    rows = (Waypoint.__struct_fields__, *map(astuple, found))
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
