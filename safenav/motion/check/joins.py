"""The rules of pieces of motion: limits of flights and drives, and continuity.

A robot's pieces follow each other without gap, jump or jerk of velocity."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, hypot, sin

import numpy as np

from safenav.motion.check.examination import NEAR, Examination
from safenav.motion.check.paths import Array, grid
from safenav.motion.file.records import Curve, Flight, Moving, Reset, Segment
from safenav.motion.polynomial import derivative, values

State = tuple[float, ...]


def check_path(case: Examination, piece: Flight) -> None:
    """Check the limits of a flyer's reference, or of the path of a disc or a rover, and that its
    parts join."""
    seconds, lasting = [part.seconds for part in piece.parts], piece.t1 - piece.t0
    if abs(sum(seconds) - lasting) > NEAR or min(seconds, default=0) < 0:
        found = f"its pieces last {sum(seconds):.4f} s in all, not {lasting:.4f} s"
        case.wrong(piece.t0, piece.robot, "time", found)
    begin = piece.t0
    for part in piece.parts:
        _moved(case, piece, part, begin)
        begin += part.seconds
    for before, after in pairwise(piece.parts):
        jump = _apart(_part_state(before, before.seconds), _part_state(after, 0.0))
        if jump > NEAR:
            case.wrong(piece.t0, piece.robot, "continuity", f"it jumps by {jump:.4f} m")


def _moved(case: Examination, piece: Flight, curve: Curve, begin: float) -> None:
    t = grid(curve.seconds)
    (east, north), pulls = (
        [values(derivative(axis, order), t) for axis in (curve.x, curve.y)] for order in (1, 2)
    )
    pull = np.hypot(*pulls)
    _limited(case, piece, begin + t, np.hypot(east, north), "speed", "m/s")
    _limited(case, piece, begin + t, pull, "tilt", "m/s^2")
    _limited(case, piece, begin + t, pull, "acceleration", "m/s^2")
    turning = np.abs(values(derivative(curve.yaw), t))
    _limited(case, piece, begin + t, turning, "turning", "rad/s")
    if case.motion.header.robots[piece.robot]["kind"] == "rover":
        yaw = values(curve.yaw, t)
        slip = np.abs(east * np.sin(yaw) - north * np.cos(yaw))
        if slip.max() > NEAR:
            found = f"it moves sideways at {slip.max():.3f} m/s"
            case.wrong(float(begin + t[slip.argmax()]), piece.robot, "slip", found)
    height = case.numbers[piece.robot].get("altitude")
    off = np.abs(values(curve.z, t) - height) if height is not None else np.zeros(1)
    if off.max() > NEAR:
        found = f"{off.max():.3f} m off its altitude"
        case.wrong(float(begin + t[off.argmax()]), piece.robot, "altitude", found)


def _part_state(part: Curve, t: float) -> State:
    """Return x, y, their speeds, and other values that must not jump, at a time of a part."""
    x, y, z, yaw = (values(axis, t) for axis in (part.x, part.y, part.z, part.yaw))
    axes = (part.x, part.y, part.yaw, part.z)
    speeds = tuple(values(derivative(axis), t) for axis in axes)
    return (x, y, *speeds[:2], cos(yaw), sin(yaw), speeds[2], z, speeds[3])


def _apart(one: State, other: State) -> float:
    """Return the largest difference of two states."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def _limited(
    case: Examination, piece: Flight, times: Array, found: Array, limit: str, unit: str
) -> None:
    """Check values of a piece against one of its robot's limits, if it has that."""
    most, worst = case.numbers[piece.robot].get(limit), int(found.argmax())
    if most is not None and found[worst] > most + NEAR:
        what = f"{found[worst]:.3f} {unit}, more than {most:g}"
        case.wrong(float(times[worst]), piece.robot, limit, what)


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
    if abs(last.t1 - case.makespan) > NEAR and last.t1 not in resets:
        found = f"no motion recorded from {last.t1:.3f} s to the end at {case.makespan:.3f} s"
        case.wrong(last.t1, robot, "continuity", found)
    speed = hypot(*_end(first, last=False)[2:4])
    if speed > NEAR:
        case.wrong(0.0, robot, "continuity", f"it starts with {speed:.3f} m/s")
    for before, after in pairwise(pieces):
        if after.t0 not in resets:
            joined(case, before, after)


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
    if type(before) is not type(after):
        wrong("it continues as another kind of robot")
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
    """The feet at the end of a segment are those at the start of the next one."""
    lasting = before.t1 - before.t0
    last, first = before.phases[-1], after.phases[0]
    if (jump := hypot(first.x - last.to_x, first.y - last.to_y)) > NEAR:
        wrong(f"its centre of pressure jumps by {jump:.4f} m")
    for side in (1, -1):
        there = [f for f in before.feet if f.side == side and abs(f.up - lasting) < NEAR]
        here = [f for f in after.feet if f.side == side and abs(f.down) < NEAR]
        if there and here:
            jump = float(np.hypot(there[0].x - here[0].x, there[0].y - here[0].y))
            if jump > NEAR:
                wrong(f"a foot on the ground jumps by {jump:.4f} m")
    up = [
        swing for swing in before.swings if abs(swing.t1 - lasting) < NEAR and swing.u1 < 1 - NEAR
    ]
    on = [swing for swing in after.swings if abs(swing.t0) < NEAR and swing.u0 > NEAR]
    if len(up) != len(on):
        wrong("a foot in the air is lost")
    turned = np.remainder(_yaw(after, 0.0) - _yaw(before, lasting) + np.pi, 2 * np.pi) - np.pi
    if abs(turned) > NEAR:
        wrong(f"its body jumps by {turned:.4f} rad")
    for one, other in zip(up, on, strict=False):
        if abs(one.u1 - other.u0) > NEAR:
            wrong("a foot in the air jumps up or down")
        off = np.abs(np.subtract(one.goal, other.start))
        turned = abs(np.remainder(off[2] + np.pi, 2 * np.pi) - np.pi)
        if one.side != other.side or max(*off[[0, 1, 3, 4, 5]], turned) > NEAR:
            wrong("a foot in the air jumps")


def _yaw(segment: Segment, t: float) -> float:
    """The yaw of a walker's body: a quintic step."""
    before, after, begin, end = segment.turning
    u = min(1.0, max(0.0, (t - begin) / (end - begin))) if end > begin else 1.0
    return before + (after - before) * u**3 * (10 - 15 * u + 6 * u**2)


def _end(piece: Moving, *, last: bool) -> State:
    """Return at one end the position, then velocity and other values that must not jump."""
    if isinstance(piece, Segment):
        return piece.goal if last else piece.start
    assert isinstance(piece, Flight)
    part = piece.parts[-1 if last else 0]
    return _part_state(part, part.seconds if last else 0.0)
