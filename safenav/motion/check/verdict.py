"""All rules of a motion, and the findings by time.

Contradictions between a motion file and its trace are excluded first. This module also contains the
rules of flights and of consecutive pieces: no gap, no jump, no sudden change of velocity.
"""

from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from math import atan2, cos, dist, hypot, remainder, sin, tau
from pathlib import Path

import numpy as np

from safenav.errors import UsageError
from safenav.motion import file
from safenav.motion.check.examination import (
    STILL,
    Examination,
    Finding,
    check_distances,
    check_room,
    check_tracks,
)
from safenav.motion.check.order import check_order
from safenav.motion.check.walk import NEAR
from safenav.motion.columns import body_yaw
from safenav.motion.file import Curve, Flight, Moving, Segment
from safenav.motion.geometry import slope
from safenav.trace.file import Trace


def read_motion_of(path: Path, trace: Trace, name: Path) -> file.Motion:
    """Return the motion of a trace in the file ``path``. ``name``: the file of the trace.

    Raises InputError as ``read_motion``, and UsageError for the motion of another trace or with
    impossible times.
    """
    motion = file.read_motion(path)
    found = mismatch(motion, trace) or _gap(motion)
    if found:
        hint = f"recompute it: safenav export {name} --motion {path}"
        raise UsageError(f"{path}: {found}\n    {hint}")
    return motion


def _gap(motion: file.Motion) -> str:
    """Return the error of a motion in which some robot's pieces leave a gap or overlap between the
    start and the end; empty if there is none."""
    for name in motion.header.robots:
        pieces = motion.of(Moving, name)
        begins = [*(piece.t0 for piece in pieces), motion.outcome.makespan]
        ends = [0.0, *(piece.t1 for piece in pieces)]
        apart = max(abs(begin - end) for begin, end in zip(begins, ends, strict=True))
        if apart > NEAR or any(piece.t1 < piece.t0 for piece in pieces):
            return f"{name}: the pieces of its motion do not follow one another in time"
    return ""


def mismatch(motion: file.Motion, trace: Trace) -> str:
    """Return the first contradiction within a motion, or between it and its trace; empty if there
    is none."""
    header, world = motion.header, trace.header.scenario.map
    if header.trace != trace.digest:
        return "the motion is of another trace, whose header has another sha256"
    if (header.rows, header.cols) != (world.rows, world.cols):
        return f"its map of {header.rows} x {header.cols} regions is not that of the trace"
    if set(header.robots) != set(trace.robots):
        return f"the robots {', '.join(sorted(header.robots))[:80]} are not those of the trace"
    if header.origin != world.placement:
        return "the origin of its map is not that of the trace"
    for name, robot in trace.robots.items():
        own, expected = header.robots[name], file.described(robot)
        if not expected:
            return f"{name} has no motion model in the trace"
        for key, value in expected.items():
            if own.get(key) != value:
                found = repr(own[key]) if key in own else "missing"
                return f"{name}: '{key}' is {found}; expected {value!r}"
    stranger = next((line.robot for line in motion.lines if line.robot not in header.robots), None)
    if stranger is not None:
        return f"{stranger[:40]} is not a robot of the header"
    kinds = {name: limits["kind"] for name, limits in header.robots.items()}
    for piece in motion.of(Moving):
        walks, walker = isinstance(piece, Segment), kinds[piece.robot] == "walker"
        if walks is not walker:
            found = "walks but is not a walker" if walks else "is a walker but does not walk"
            return f"{piece.robot} at {piece.t0:.3f} s: it {found}"
    for track in motion.of(file.FlownTrack):
        if kinds[track.robot] != "flyer":
            return f"{track.robot}: a simulated flight, but it is not a flyer"
    return ""


def check_flights(case: Examination, robot: str) -> None:
    """Check the limits of a flyer's references, or of a disc's or rover's paths, and the joins of
    their parts."""
    flights = [piece for piece in case.pieces[robot] if isinstance(piece, Flight)]
    for piece in flights:
        seconds, lasting = [part.seconds for part in piece.parts], piece.t1 - piece.t0
        if abs(sum(seconds) - lasting) > NEAR or min(seconds) < 0:
            found = f"its pieces last {sum(seconds):.4f} s in all, not {lasting:.4f} s"
            case.wrong(piece.t0, robot, "time", found)
            return
        for before, after in pairwise(piece.parts):
            for found in _jumps(before, after):
                case.wrong(piece.t0, robot, "continuity", found)
    if not flights:
        return
    times, states = zip(*(part for piece in flights for part in case.flown(piece)), strict=True)
    place, speed, pull = np.concatenate(states, axis=2)
    own, limited = case.numbers[robot], partial(case.limit, robot, np.concatenate(times))
    pulled = np.hypot(pull[0], pull[1])
    for limit, unit, measured in (
        ("speed", "m/s", np.hypot(speed[0], speed[1])),
        *(("tilt", "m/s^2", pulled), ("acceleration", "m/s^2", pulled)),
        ("turning", "rad/s", np.abs(speed[3])),
    ):
        if limit in own:
            words = f"{{:.3f}} {unit}, more than {own[limit]:g}"
            limited(measured, own[limit] + NEAR, limit, words)
    kind = case.motion.header.robots[robot]["kind"]
    if kind == "rover":
        slip = np.abs(speed[0] * np.sin(place[3]) - speed[1] * np.cos(place[3]))
        limited(slip, NEAR, "slip", "it moves sideways at {:.3f} m/s")
    off = np.abs(place[2] - (own["altitude"] if kind == "flyer" else 0.0))
    limited(off, NEAR, "altitude", "{:.3f} m off its altitude")


UNITS = {"its velocity": "m/s", "its body": "rad"}
"""Units of values that may jump; default: metres."""
FEET = {1: "its left foot", -1: "its right foot"}


def _jumps(before: Curve | Moving, after: Curve | Moving) -> Iterator[str]:
    """Yield each sudden change between two pieces of motion, or two parts of one."""
    end, start = _state(before, last=True), _state(after, last=False)
    for what, ended in end.items():
        if what not in start:  # for example, a foot in the air is next on the ground
            yield f"{what} is lost"
        elif (jump := dist(ended, start[what])) > NEAR:
            yield f"{what} jumps by {jump:.4f} {UNITS.get(what, 'm')}"
    for what in sorted(start.keys() - end.keys()):
        if what.endswith("in the air"):
            yield f"{what} has no earlier position"


def _state(piece: Curve | Moving, *, last: bool) -> dict[str, tuple[float, ...]]:
    """Return the values, by name, that must not jump at the start or end (``last``) of a piece."""
    if isinstance(piece, Segment):
        return dict(_walking(piece, last=last))
    if not isinstance(piece, Curve):
        assert isinstance(piece, Flight)
        piece = piece.parts[-1 if last else 0]
    t, axes = piece.seconds if last else 0.0, (piece.x, piece.y, piece.z, piece.yaw)
    (x, east), (y, north), (z, up), (yaw, turning) = (slope(axis, t) for axis in axes)
    facing = cos(yaw), sin(yaw), turning
    return {"it": (x, y, z), "its velocity": (east, north, up), "its body": facing}


def _walking(piece: Segment, *, last: bool) -> Iterator[tuple[str, tuple[float, ...]]]:
    t, mass = (piece.t1 - piece.t0, piece.goal) if last else (0.0, piece.start)
    yaw, phase = float(body_yaw(piece, np.array([t]))[0]), piece.phases[-1 if last else 0]
    yield "it", mass[:2]
    yield "its velocity", mass[2:]
    yield "its centre of pressure", (phase.to_x, phase.to_y) if last else (phase.x, phase.y)
    yield "its body", (cos(yaw), sin(yaw))
    for foot in piece.feet:
        if abs((foot.up if last else foot.down) - t) < NEAR:
            yield f"{FEET[foot.side]} on the ground", (foot.x, foot.y, cos(foot.yaw), sin(foot.yaw))
    for swing in piece.swings:
        ends = (swing.t1, swing.u1, swing.goal) if last else (swing.t0, swing.u0, swing.start)
        at, u, (x, y, yaw, *rates) = ends
        if abs(at - t) < NEAR and NEAR < u < 1 - NEAR:
            pose = x, y, cos(yaw), sin(yaw)
            yield f"{FEET[swing.side]} in the air", (*pose, *rates[:3], u)


def check_joins(case: Examination, robot: str) -> None:
    """Check that a robot's pieces follow each other from the start to the end of the motion."""
    pieces = case.pieces[robot]
    if not pieces:
        if case.makespan > NEAR:  # a run without duration needs no motion
            case.wrong(0.0, robot, "continuity", "no motion recorded for this robot")
        return
    first, last = pieces[0], pieces[-1]
    if abs(first.t0) > NEAR:
        found = f"no motion recorded until {first.t0:.3f} s"
        case.wrong(0.0, robot, "continuity", found)
    if abs(last.t1 - case.makespan) > NEAR:
        found = f"no motion recorded from {last.t1:.3f} s to the end at {case.makespan:.3f} s"
        case.wrong(last.t1, robot, "continuity", found)
    speed = hypot(*_state(first, last=False)["its velocity"])
    if speed > NEAR:
        case.wrong(0.0, robot, "continuity", f"it starts with {speed:.3f} m/s")
    for before, after in pairwise(pieces):
        joined(case, before, after)
    for piece in pieces:
        if piece.origin == piece.to:
            continue
        if isinstance(piece, Segment):
            (col, row), (to_col, to_row) = map(case.grid.place, (piece.origin, piece.to))
            off = remainder(piece.turning[1] - atan2(to_row - row, to_col - col), tau)
            if abs(off) > NEAR:
                found = f"it faces {abs(off):.3f} rad off the direction of its step to {piece.to}"
                case.wrong(piece.t1, robot, "turning", found)
        elif (off := dist(_place(piece), case.grid.centre(piece.origin))) > STILL:
            what = f"it begins a step {off:.3f} m from the centre of region {piece.origin}"
            case.wrong(piece.t0, robot, "centre", what)
    for piece, region, ended in ((first, first.origin, False), (last, last.to, True)):
        there = np.array([_place(piece, last=ended)])
        off = float(case.grid.distance(there, case.grid.place(region))[0])
        if off > STILL:
            what = f"it {'ends' if ended else 'begins'} {off:.3f} m outside region {region}"
            case.wrong(piece.t1 if ended else 0.0, robot, "room", what)


def joined(case: Examination, before: Moving, after: Moving) -> None:
    """Check that the piece ``after`` continues the piece ``before`` in time and in space."""

    def wrong(found: str) -> None:
        case.wrong(before.t1, before.robot, "continuity", found)

    if after.t0 > before.t1 + NEAR:
        wrong(f"no motion recorded for {after.t0 - before.t1:.3f} s")
        return
    if after.t0 < before.t1 - NEAR:
        wrong(f"two pieces of motion overlap by {before.t1 - after.t0:.3f} s")
        return
    if before.to != after.origin:
        wrong(f"it continues in region {after.origin}, not in {before.to}")
    for found in _jumps(before, after):
        wrong(found)


def _place(piece: Moving, *, last: bool = False) -> tuple[float, ...]:
    """Return x and y of the body's centre at the start or the end (``last``) of a piece."""
    return _state(piece, last=last)["it"][:2]


def check_motion(motion: file.Motion, trace: Trace) -> list[Finding]:
    """Return the broken rules by time; none if the motion carries out the trace as
    docs/motion_file.md demands."""
    if found := mismatch(motion, trace):
        return [Finding(0.0, "", "header", found)]
    case = Examination(motion, trace)
    for segment in motion.of(Segment):
        if any(swing.t1 <= swing.t0 for swing in segment.swings):
            case.wrong(segment.t0, segment.robot, "time", "a swing that takes no time")
            continue
        for t, rule, found in case.walked(segment).broken:
            case.wrong(segment.t0 + t, segment.robot, rule, found)
    for name in case.pieces:
        check_flights(case, name)
    if not case.findings:  # rules of paths assume pieces that keep their own rules
        _check_paths(case)
    return sorted(case.findings, key=lambda finding: finding.t)


def _check_paths(case: Examination) -> None:
    """Check the rules of a motion whose pieces keep their own rules."""
    for name, robot in case.trace.robots.items():
        pieces = case.pieces[name]
        check_joins(case, name)
        if pieces and pieces[0].origin != robot.start.region:
            what = f"it starts in region {pieces[0].origin}, not in {robot.start.region}"
            case.wrong(0.0, name, "order", what)
    check_room(case)
    check_tracks(case)
    check_order(case)
    check_distances(case)
