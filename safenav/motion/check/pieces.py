"""The rules of pieces of motion: the pendulum of a walker and feet that support it; limits of
flights and drives; pieces that follow each other without gap, jump or jerk of velocity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from math import cos, hypot, remainder, sin, tau

import numpy as np

from safenav.motion.check.examination import (
    NEAR,
    Array,
    Examination,
    Walked,
)
from safenav.motion.file import Curve, Flight, Foothold, Moving, Reset, Segment
from safenav.motion.geometry import Mass, derivative, values

GRAVITY = 9.81
INNER = 0.6
"""Share of a sole, around its middle, in which the centre of pressure stays."""

Wrong = Callable[[float, str, str], None]


def check_segment(
    segment: Segment,
    limits: Mapping[str, float],
    walked: Walked,
    wrong: Wrong,
    *,
    cut: bool = False,
) -> None:
    """Report each broken rule with its time since the segment's start. ``cut``: it was cut off."""
    path = walked.mass
    omega, height = limits["omega"], limits["height"]
    gravity = omega**2 * height
    if abs(gravity - GRAVITY) > 1e-6:
        wrong(0, "gravity", f"a gravity of {gravity:.4f} m/s^2, not {GRAVITY}")
        return
    lasting = sum(phase.seconds for phase in segment.phases)
    if abs(lasting - (segment.t1 - segment.t0)) > NEAR:
        wrong(0, "time", f"phases of {lasting:.4f} s in {segment.t1 - segment.t0:.4f} s")
        return
    for end, missed in (("start", path.late), ("goal", path.early)):
        if missed > 1e-8:
            what = f"the centre of mass misses the {end} of its segment by {missed:.4f} m"
            wrong(0, "dynamics", what)
            return
    pull = np.hypot(*(path.states[:, :2] - path.pressures).T) / height
    worst = int(pull.argmax())
    if pull[worst] > limits["friction"]:
        what = f"friction of {pull[worst]:.3f} needed, more than {limits['friction']:g}"
        wrong(float(path.times[worst]), "friction", what)
    if _support(segment, limits, wrong) and not cut:
        _double(segment, limits, wrong)
    _stance(segment, path, limits, wrong)
    _steps(segment, limits, wrong)
    _swings(segment, walked.speeds, limits, wrong)


def _support(segment: Segment, limits: Mapping[str, float], wrong: Wrong) -> bool:
    """Check that the centre of pressure is always under the feet on the ground, and never jumps."""
    begin = 0.0
    last = segment.phases[0]
    sole = limits["sole_length"] / 2 * INNER, limits["sole_width"] / 2 * INNER
    for phase in segment.phases:
        if begin and hypot(phase.x - last.to_x, phase.y - last.to_y) > NEAR:
            wrong(begin, "support", "the centre of pressure jumps")
            return False
        end, last = begin + phase.seconds, phase
        down = [f for f in segment.feet if f.down <= begin + NEAR and f.up >= end - NEAR]
        if not down:
            wrong(begin, "support", "no foot is on the ground")
            return False
        ends = {(phase.x, phase.y), (phase.to_x, phase.to_y)}  # one, while it rests
        off = max(_off(down, x, y, sole) for x, y in ends)
        if off > NEAR:
            what = f"the centre of pressure is {off:.3f} m outside the feet on the ground"
            wrong(begin, "support", what)
            return False
        begin = end
    return True


def _double(segment: Segment, limits: Mapping[str, float], wrong: Wrong) -> None:
    """Both feet are on the ground for a share of a walk, which begins and ends on one foot."""
    lasting = segment.t1 - segment.t0
    ends = [
        sum(foot.down <= t + NEAR and foot.up >= t - NEAR for foot in segment.feet)
        for t in (0.0, lasting)
    ]
    if ends != [1, 1]:
        return
    carried = sum(foot.up - foot.down for foot in segment.feet)
    share, least, most = carried / lasting - 1, limits["least_double"], limits["most_double"]
    if not least - NEAR <= share <= most + NEAR:
        what = f"both feet are on the ground for {share:.3f} of the time, not {least:g} to {most:g}"
        wrong(0.0, "double support", what)


def _stance(segment: Segment, path: Mass, limits: Mapping[str, float], wrong: Wrong) -> None:
    """The mass stays near each foot that carries it."""
    feet = np.array([(foot.down, foot.up, foot.x, foot.y) for foot in segment.feet])
    down, up, x, y = feet.T[:, :, None]
    off = np.hypot(path.states[:, 0] - x, path.states[:, 1] - y)
    off[(path.times < down) | (path.times > up)] = 0.0
    if off.max() > limits["stance"] + NEAR:
        t = float(path.times[int(off.max(axis=0).argmax())])
        far = f"the mass is {off.max():.3f} m from a foot that carries it"
        wrong(t, "stance", f"{far}, more than {limits['stance']:g}")


def _off(feet: list[Foothold], x: float, y: float, sole: tuple[float, float]) -> float:
    """Return a point's distance from the span of one or two feet, each with a margin of ``sole``
    metres ahead and aside."""
    one, other = feet[0], feet[-1]
    across = (other.x - one.x, other.y - one.y)
    square = across[0] ** 2 + across[1] ** 2
    share = 0.0
    if square > 0:
        share = ((x - one.x) * across[0] + (y - one.y) * across[1]) / square
        share = min(1.0, max(0.0, share))
    dx, dy = x - one.x - share * across[0], y - one.y - share * across[1]
    c, s = cos(one.yaw), sin(one.yaw)
    return max(0.0, abs(dx * c + dy * s) - sole[0], abs(dy * c - dx * s) - sole[1])


def _steps(segment: Segment, limits: Mapping[str, float], wrong: Wrong) -> None:
    for before, after in pairwise(segment.feet):
        dx, dy = after.x - before.x, after.y - before.y
        length = hypot(dx, dy)
        if length > limits["step"] + NEAR:
            wrong(after.down, "step", f"a step of {length:.3f} m, more than {limits['step']:g}")
        if before.side == after.side:
            continue
        yaw = (before.yaw + after.yaw) / 2
        aside = after.side * (dy * cos(yaw) - dx * sin(yaw))
        if aside < limits["aside"] - NEAR:
            what = f"a foot lands {aside:.3f} m beside the other, less than {limits['aside']:g}"
            wrong(after.down, "feet", what)


def _swings(segment: Segment, fastest: Array, limits: Mapping[str, float], wrong: Wrong) -> None:
    for swing, speed in zip(segment.swings, fastest.max(axis=1).tolist(), strict=True):
        if speed > limits["swing"] + NEAR:
            what = f"a foot swings at {speed:.2f} m/s, more than {limits['swing']:g}"
            wrong(swing.t0, "swing", what)
        into, out = swing.t0 < NEAR, swing.t1 > segment.t1 - segment.t0 - NEAR
        low, high = (0.0 if into else swing.u0), (1.0 if out else swing.u1)
        if (low, high) != (0.0, 1.0) or not 0 <= swing.u0 < swing.u1 <= 1:
            wrong(swing.t0, "feet", "a foot is in the air where its step begins or ends")
        mine = [foot for foot in segment.feet if foot.side == swing.side]
        lifted = [foot for foot in mine if abs(foot.up - swing.t0) < NEAR]
        landed = [foot for foot in mine if abs(foot.down - swing.t1) < NEAR]
        for word, u, feet, state in (
            ("leaves", swing.u0 - 0.0, lifted, swing.start),
            ("reaches", 1.0 - swing.u1, landed, swing.goal),
        ):
            if abs(u) > NEAR:
                continue  # half-way at a walking pose: the next segment continues it
            apart = min((hypot(f.x - state[0], f.y - state[1]) for f in feet), default=None)
            turned = min((abs(f.yaw - state[2]) for f in feet), default=0.0)
            if turned > NEAR or max(map(abs, state[3:6])) > NEAR:
                what = f"a foot {word} the ground as it moves, or {turned:.3f} rad off its foothold"
                wrong(swing.t0, "feet", what)
            if apart is None:
                wrong(swing.t0, "feet", f"a foot {word} the ground where it has no foothold")
            elif apart > NEAR:
                what = f"a swinging foot {word} the ground {apart:.3f} m from its foothold"
                wrong(swing.t0, "feet", what)
    _grounded(segment, wrong)


def _grounded(segment: Segment, wrong: Wrong) -> None:
    """Each foot is either on the ground or in the air."""
    for side in (1, -1):
        spans = [(f.down, f.up) for f in segment.feet if f.side == side]
        spans += [(s.t0, s.t1) for s in segment.swings if s.side == side]
        spans.sort()
        reached = 0.0
        for begin, end in spans:
            if abs(begin - reached) > NEAR:
                what = "is recorded twice" if begin < reached else "has no position"
                foot = "left" if side == 1 else "right"
                wrong(begin, "feet", f"the {foot} foot {what}")
                return
            reached = end
        if abs(reached - (segment.t1 - segment.t0)) > NEAR:
            wrong(reached, "feet", f"the {'left' if side == 1 else 'right'} foot has no position")
            return


State = tuple[float, ...]


def check_path(case: Examination, piece: Flight) -> None:
    """Check the limits of a flyer's reference, or of the path of a disc or a rover, and that its
    parts join."""
    seconds, lasting = [part.seconds for part in piece.parts], piece.t1 - piece.t0
    if abs(sum(seconds) - lasting) > NEAR or min(seconds, default=0) < 0:
        found = f"its pieces last {sum(seconds):.4f} s in all, not {lasting:.4f} s"
        case.wrong(piece.t0, piece.robot, "time", found)
        return
    for times, states in case.flown(piece):
        _moved(case, piece, times, states)
    for before, after in pairwise(piece.parts):
        jump = _apart(_part_state(before, before.seconds), _part_state(after, 0.0))
        if jump > NEAR:
            case.wrong(piece.t0, piece.robot, "continuity", f"it jumps by {jump:.4f} m")


def _moved(case: Examination, piece: Flight, times: Array, states: Array) -> None:
    place, speed, pull = states
    own, limited = case.numbers[piece.robot], partial(case.limit, piece.robot, times)
    pulled = np.hypot(pull[0], pull[1])
    for limit, unit, measured in (
        ("speed", "m/s", np.hypot(speed[0], speed[1])),
        *(("tilt", "m/s^2", pulled), ("acceleration", "m/s^2", pulled)),
        ("turning", "rad/s", np.abs(speed[3])),
    ):
        if limit in own:
            words = f"{{:.3f}} {unit}, more than {own[limit]:g}"
            limited(measured, own[limit] + NEAR, limit, words)
    if case.motion.header.robots[piece.robot]["kind"] == "rover":
        slip = np.abs(speed[0] * np.sin(place[3]) - speed[1] * np.cos(place[3]))
        limited(slip, NEAR, "slip", "it moves sideways at {:.3f} m/s")
    if "altitude" in own:
        off = np.abs(place[2] - own["altitude"])
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
            jump = hypot(there[0].x - here[0].x, there[0].y - here[0].y)
            if jump > NEAR:
                wrong(f"a foot on the ground jumps by {jump:.4f} m")
    up = [
        swing for swing in before.swings if abs(swing.t1 - lasting) < NEAR and swing.u1 < 1 - NEAR
    ]
    on = [swing for swing in after.swings if abs(swing.t0) < NEAR and swing.u0 > NEAR]
    if len(up) != len(on):
        wrong("a foot in the air is lost")
    turned = remainder(_yaw(after, 0.0) - _yaw(before, lasting), tau)
    if abs(turned) > NEAR:
        wrong(f"its body jumps by {turned:.4f} rad")
    for one, other in zip(up, on, strict=False):
        if abs(one.u1 - other.u0) > NEAR:
            wrong("a foot in the air jumps up or down")
        off = [a - b for a, b in zip(one.goal, other.start, strict=True)]
        off[2] = remainder(off[2], tau)
        if one.side != other.side or max(map(abs, off[:6])) > NEAR:
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
