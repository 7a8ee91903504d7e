"""A run as waypoints in metres, for a robot stack to follow: read from the trace alone.

A waypoint is the centre of a robot's region at the end of a tick or, in a live run, of each of its
steps, in the frame of ROS map_server: x grows east, y grows north, the origin is the south-western
corner (docs/maps.md).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import remainder, tau

from msgspec import Struct

from safenav.errors import Diagnostic, InputError, UsageError
from safenav.lines import csv_text
from safenav.pace.robot import YAW
from safenav.trace.reading import Trace
from safenav.trace.records import Arrive, Move
from safenav.world.map import Frame

_DECIMALS = 6


class Waypoint(Struct, frozen=True):
    """Position of a robot at the end of a tick (0: the start), or at a time ``t`` in seconds.
    ``yaw`` is counterclockwise from the x axis, in radians; None for a robot without a heading."""

    robot: str
    tick: int
    x: float
    y: float
    yaw: float | None
    region: int
    t: float | None = None


def frame_of(
    trace: Trace, resolution: float | None = None, origin: tuple[float, float] | None = None
) -> Frame:
    """The frame of the trace's map; ``resolution`` and ``origin`` (metres) replace its own.

    Raises UsageError if the size of a region is missing, InputError if it is not positive.
    """
    world = trace.header.scenario.map
    sides = world.resolution if resolution is None else (resolution, resolution)
    if sides is None:
        raise UsageError(
            f"{trace.source}: the size of a region in metres is missing\n"
            "    add --side 0.5, or 'resolution' to the map of the scenario"
        )
    if min(sides) <= 0:
        found = "the resolution of the map is not positive"
        raise InputError([Diagnostic(trace.source, trace.header.line, 1, found)])
    x, y, yaw = world.origin or (0.0, 0.0, 0.0)
    return Frame(sides, (x, y), yaw) if origin is None else Frame(sides, origin)


def waypoints(trace: Trace, frame: Frame) -> list[Waypoint]:
    """The waypoints of all robots, one robot after the other. Raises InputError for a robot that is
    not in the team, or a region off the map."""
    header, world = trace.header, trace.header.scenario.map
    by_robot: dict[str, list[Waypoint]] = {name: [] for name in header.scenario.robots}

    def add(
        line: int, robot: str, tick: int, region: int, facing: str | None, t: float | None
    ) -> None:
        found = ""
        if robot not in by_robot:
            found = f"'{robot[:40]}' is not a robot of this trace"
        elif not 0 <= region < world.rows * world.cols:
            found = f"{robot} is in region {region}, which is not on the map"
        if found:
            raise InputError([Diagnostic(trace.source, line, 1, found)])
        row, col = divmod(region, world.cols)
        x, y = (round(value, _DECIMALS) for value in frame.centre(row, col, world.rows))
        yaw = None if facing is None else round(remainder(YAW[facing] + frame.yaw, tau), _DECIMALS)
        by_robot[robot].append(Waypoint(robot, tick, x, y, yaw, region, t))

    start = None if header.clock is None else 0.0
    for name, robot in header.scenario.robots.items():
        add(header.line, name, 0, robot.start, robot.heading, start)
    for record in trace.records:
        if isinstance(record, Move | Arrive):
            region = record.to if isinstance(record, Move) else record.at
            add(record.line, record.robot, record.tick, region, record.heading, record.t)
    return [waypoint for one in by_robot.values() for waypoint in one]


def _columns(found: Sequence[Waypoint]) -> tuple[str, ...]:
    when = "t" if any(waypoint.t is not None for waypoint in found) else "tick"
    return ("robot", when, "x", "y", "yaw", "region")


def as_csv(found: Sequence[Waypoint]) -> str:
    """A line for each waypoint, below a line of headings; no yaw is an empty field."""
    columns = _columns(found)
    return csv_text(columns, ([getattr(one, column) for column in columns] for one in found))


def as_json(found: Sequence[Waypoint], frame: Frame) -> str:
    """The frame, and the waypoints of each robot, one on a line."""
    robots: dict[str, list[str]] = {}
    for waypoint in found:
        entry = {column: getattr(waypoint, column) for column in _columns(found)[1:]}
        robots.setdefault(waypoint.robot, []).append(json.dumps(entry))
    joint = ",\n"
    lists = joint.join(f"{json.dumps(n)}: [\n{joint.join(lines)}\n]" for n, lines in robots.items())
    sides, origin = json.dumps(frame.resolution), json.dumps([*frame.origin, frame.yaw])
    return f'{{"resolution": {sides}, "origin": {origin}, "robots": {{\n{lists}\n}}}}\n'
