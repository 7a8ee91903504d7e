"""All rules of a motion, and its findings by time.

Contradictions between a motion file and its trace are excluded first. This module also has the
rules of flights and drives, and those of consecutive pieces: no gap, no jump, no sudden change of
velocity.
"""

from collections.abc import Callable, Mapping
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
    holdings,
)
from safenav.motion.check.execution import GOALS, check_execution
from safenav.motion.check.order import check_order
from safenav.motion.check.walk import NEAR
from safenav.motion.columns import body_yaw
from safenav.motion.file import Curve, Flight, Moving, Reset, Segment
from safenav.motion.geometry import derivative, values
from safenav.trace.file import Trace

AT_LEAST = ("aside", "least_double")
"""The limits of a walker that are lower bounds; the others are upper ones."""
WALKER = ("omega", "height", "size", "clearance", *file.BUILD)
"""The fields that a header must have for a walker."""

GAPS = {"setpoints": 1.0, "goals": 2.0}
"""Maximum time without a measurement, in seconds, by the way in which a robot is driven."""


def read_motion_of(path: Path, trace: Trace, name: Path) -> file.Motion:
    """Return the motion of this trace in a file; ``name``: the file of the trace.

    Raises InputError as ``read_motion``, and UsageError for the motion of another trace.
    """
    motion = file.read_motion(path)
    found = mismatch(motion, trace)
    if found:
        hint = f"recompute it: safenav export {name} --motion {path}"
        raise UsageError(f"{path}: {found}\n    {hint}")
    return motion


def mismatch(motion: file.Motion, trace: Trace) -> str:
    """Return the first contradiction between the parts of a motion, or with its trace; empty if
    there is none."""
    header, world = motion.header, trace.header.scenario.map
    if header.trace != trace.digest:
        return "the motion is of another trace: the sha256 of its header is not this one's"
    if (header.rows, header.cols) != (world.rows, world.cols):
        return f"a map of {header.rows} x {header.cols} regions"
    if set(header.robots) != set(trace.robots):
        return f"the robots {', '.join(sorted(header.robots))[:80]} are not those of the trace"
    if header.origin != world.placement:
        return "the origin of its map is not that of the trace"
    for name, limits in header.robots.items():
        if not isinstance(limits.get("kind"), str):
            return f"{name}: 'kind' is missing, or no text"
        for key in WALKER if limits["kind"] == "walker" else ("size",):
            value = limits.get(key)
            if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
                return f"{name}: '{key}' is missing, or not a positive number"
        if found := _limits(trace, name, limits):
            return f"{name}: {found}"
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


def _limits(trace: Trace, name: str, limits: Mapping[str, object]) -> str:
    """Return the first parameter of a robot that differs from the trace, or limit that exceeds the
    known ones; empty if there is none."""
    figures = trace.robots[name].model.figures
    if figures is None:
        return "in the trace it has no motion in metres"
    for key, value in figures.items():
        if limits.get(key) != value:
            return f"'{key}' is {limits.get(key)!r}, in the trace {value!r}"
    for key, bound in file.BUILD.items() if limits["kind"] == "walker" else ():
        value = limits[key]
        assert isinstance(value, int | float)
        if not (value >= bound if key in AT_LEAST else value <= bound):
            return f"'{key}' is {value:g}; the limit of a walker is {bound:g}"
    if "driven" in limits:
        if trace.header.world != "external":
            return "it is driven, but the trace is of a simulated world"
        most, gap = GAPS.get(str(limits["driven"]), 0.0), limits.get("gap")
        if not (isinstance(gap, int | float) and gap <= most):
            return f"'gap' is {gap!r}, not at most {most:g} s"
    return ""


State = tuple[float, ...]


def check_flights(case: Examination, robot: str) -> None:
    """Check the limits of a flyer's references, or of the paths of a disc or a rover, and that
    their parts join."""
    flights = [piece for piece in case.pieces[robot] if isinstance(piece, Flight)]
    for piece in flights:
        seconds, lasting = [part.seconds for part in piece.parts], piece.t1 - piece.t0
        if abs(sum(seconds) - lasting) > NEAR or min(seconds) < 0:
            found = f"its pieces last {sum(seconds):.4f} s in all, not {lasting:.4f} s"
            case.wrong(piece.t0, robot, "time", found)
            return
        for before, after in pairwise(piece.parts):
            jump = _apart(_part_state(before, before.seconds), _part_state(after, 0.0))
            if jump > NEAR:
                case.wrong(piece.t0, robot, "continuity", f"it jumps by {jump:.4f} m")
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


def _part_state(part: Curve, t: float) -> State:
    """Return x, y, their speeds, and other values that must not jump, at a time of a part."""
    axes = (part.x, part.y, part.z, part.yaw)
    x, y, z, yaw = (values(axis, t) for axis in axes)
    east, north, up, turning = (values(derivative(axis), t) for axis in axes)
    return (x, y, east, north, cos(yaw), sin(yaw), turning, z, up)


def _apart(one: State, other: State) -> float:
    """Return the largest difference of two states."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def check_joins(case: Examination, robot: str) -> None:
    """Check that the pieces of one robot join, from the start to the makespan. After a reset its
    plan continues from its measured position, or ends."""
    pieces = case.pieces[robot]
    if not pieces:
        if case.makespan > NEAR:  # a run that took no time needs no motion
            case.wrong(0.0, robot, "continuity", "no motion recorded for this robot")
        return
    resets = {reset.t for reset in case.motion.of(Reset, robot) if robot in case.driven}
    first, last = pieces[0], pieces[-1]
    if abs(first.t0) > NEAR:
        found = f"no motion recorded until {first.t0:.3f} s"
        case.wrong(0.0, robot, "continuity", found)
    ends = last.t1 in resets and last.t1 < case.makespan
    if abs(last.t1 - case.makespan) > NEAR and not ends:
        found = f"no motion recorded from {last.t1:.3f} s to the end at {case.makespan:.3f} s"
        case.wrong(last.t1, robot, "continuity", found)
    speed = hypot(*_end(first, last=False)[2:4])
    if speed > NEAR:
        case.wrong(0.0, robot, "continuity", f"it starts with {speed:.3f} m/s")
    for before, after in pairwise(pieces):
        if after.t0 not in resets:
            joined(case, before, after)
    if robot in case.driven:
        return
    for piece in pieces:
        if piece.origin == piece.to:
            continue
        if isinstance(piece, Segment):
            (col, row), (to_col, to_row) = map(case.grid.place, (piece.origin, piece.to))
            off = remainder(piece.turning[1] - atan2(to_row - row, to_col - col), tau)
            if abs(off) > NEAR:
                found = f"it faces {abs(off):.3f} rad off the way of its step to region {piece.to}"
                case.wrong(piece.t1, robot, "turning", found)
        elif (off := dist(_end(piece, last=False)[:2], case.grid.centre(piece.origin))) > STILL:
            what = f"it begins a step {off:.3f} m from the centre of region {piece.origin}"
            case.wrong(piece.t0, robot, "centre", what)
    for piece, region, ended in ((first, first.origin, False), (last, last.to, True)):
        there = np.array([_end(piece, last=ended)[:2]])
        off = float(case.grid.distance(there, case.grid.place(region))[0])
        if off > STILL:
            what = f"it {'ends' if ended else 'begins'} {off:.3f} m outside region {region}"
            case.wrong(piece.t1 if ended else 0.0, robot, "room", what)


def joined(case: Examination, before: Moving, after: Moving) -> None:
    """Check that a piece continues the one before."""

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
    end, start = _end(before, last=True), _end(after, last=False)
    jump = hypot(start[0] - end[0], start[1] - end[1])
    kick = _apart(start[2:], end[2:])
    if jump > NEAR:
        wrong(f"it jumps by {jump:.4f} m")
    elif kick > NEAR:
        wrong(f"its velocity jumps by {kick:.4f} m/s")
    if isinstance(before, Segment) and isinstance(after, Segment):
        _feet(before, after, wrong)


def _feet(before: Segment, after: Segment, wrong: Callable[[str], None]) -> None:
    """Check that the feet at the end of a segment are those at the start of the next one."""
    lasting = before.t1 - before.t0
    last, first = before.phases[-1], after.phases[0]
    if (jump := hypot(first.x - last.to_x, first.y - last.to_y)) > NEAR:
        wrong(f"its centre of pressure jumps by {jump:.4f} m")
    for side in (1, -1):
        there = [f for f in before.feet if f.side == side and abs(f.up - lasting) < NEAR]
        here = [f for f in after.feet if f.side == side and abs(f.down) < NEAR]
        if there and here:
            jump = hypot(there[0].x - here[0].x, there[0].y - here[0].y)
            if max(jump, abs(remainder(there[0].yaw - here[0].yaw, tau))) > NEAR:
                wrong(f"a foot on the ground jumps by {jump:.4f} m")
    up = [
        swing for swing in before.swings if abs(swing.t1 - lasting) < NEAR and swing.u1 < 1 - NEAR
    ]
    on = [swing for swing in after.swings if abs(swing.t0) < NEAR and swing.u0 > NEAR]
    if len(up) != len(on):
        wrong("a foot in the air is lost")
    ends = body_yaw(before, np.array([lasting])), body_yaw(after, np.zeros(1))
    turned = remainder(float(ends[1][0] - ends[0][0]), tau)
    if abs(turned) > NEAR:
        wrong(f"its body jumps by {turned:.4f} rad")
    for one, other in zip(up, on, strict=False):
        if abs(one.u1 - other.u0) > NEAR:
            wrong("a foot in the air jumps up or down")
        off = [a - b for a, b in zip(one.goal, other.start, strict=True)]
        off[2] = remainder(off[2], tau)
        if one.side != other.side or max(map(abs, off[:6])) > NEAR:
            wrong("a foot in the air jumps")


def _end(piece: Moving, *, last: bool) -> State:
    """Return, for one end of a piece, the position, then the velocity and other values that must
    not jump."""
    if isinstance(piece, Segment):
        return piece.goal if last else piece.start
    assert isinstance(piece, Flight)
    part = piece.parts[-1 if last else 0]
    return _part_state(part, part.seconds if last else 0.0)


def check_motion(motion: file.Motion, trace: Trace) -> list[Finding]:
    """Return every broken rule, by time; none if the motion carries out the trace as docs/motion.md
    demands."""
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
    if not case.findings:  # a motion that cannot be solved has no path to check
        _paths(case)
    return sorted(case.findings, key=lambda finding: finding.t)


def _paths(case: Examination) -> None:
    """Check the rules for motions whose pieces are sound."""
    for name, robot in case.trace.robots.items():
        pieces = case.pieces[name]
        if case.motion.header.robots[name].get("driven") != GOALS:
            check_joins(case, name)
        if pieces and pieces[0].origin != robot.start.region:
            what = f"it starts in region {pieces[0].origin}, not in {robot.start.region}"
            case.wrong(0.0, name, "order", what)
    case.held = holdings(case)
    check_room(case)
    check_tracks(case)
    check_order(case)
    check_distances(case, {n: partial(case.places, n) for n, own in case.pieces.items() if own})
    check_execution(case)
