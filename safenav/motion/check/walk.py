"""The motion of a walker during a segment, and the rules of segments: the pendulum of the walker's
mass and the feet that support it."""

from cmath import rect
from collections.abc import Hashable, Iterator, Mapping
from itertools import combinations, pairwise
from math import ceil, cos, hypot, inf, pi, remainder, sin, tau

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.columns import body_yaw
from safenav.motion.file import Foothold, Segment
from safenav.motion.geometry import Mass, between, mass, transformed

Array = NDArray[np.float64]

STEP = 0.02
"""Seconds between samples of a body."""
INSTANTS = np.linspace(0.0, 1.0, 101)
"""Sampling instants of a swing, as fractions of its duration: between them a quintic stays within
0.5 % of its extent."""
MOST_SAMPLES = 5_000_000
"""Maximum number of samples of one piece of motion: more than a day."""
NEAR = 1e-7
"""Tolerance for the rounding of a file, in metres, seconds and radians."""
ALIKE = 9
"""Decimals (metres, seconds, radians) in which segments of one shape agree."""
GRAVITY = 9.81
TURNED = pi / 4
"""Maximum angle between the feet when one lands, and between body and grounded foot, in radians."""
INNER = 0.6
"""Central share of a sole within which the centre of pressure stays."""
Limits = Mapping[str, float]
Broken = tuple[float, str, str]
"""A broken rule of a segment: seconds since its start, rule and observation."""


def grid(seconds: float, step: float = STEP) -> Array:
    """Return times from 0 to the end, at most a step apart.

    Raises UsageError for an absurd duration, whose samples would fill the memory.
    """
    if not seconds < MOST_SAMPLES * STEP:
        most = f"expected at most {MOST_SAMPLES * STEP:,.0f} s"
        raise UsageError(f"the motion has a piece of {seconds:,.0f} s; {most}")
    count = max(1, ceil(seconds / step))
    return np.arange(count + 1, dtype=np.float64) * (seconds / count)


class Walked(Struct, frozen=True):
    """Samples of a walker during a segment. ``mass``: samples at most ``STEP`` apart, also at the
    ends of its phases. Feet in the air: times since the segment's start (swings, n), ``places``
    (swings, n, 2) and ``speeds`` (swings, n). ``broken``: the broken rules."""

    segment: Segment
    mass: Mass
    times: Array
    places: Array
    speeds: Array
    broken: list[Broken]

    def moved(self, segment: Segment, points: Array) -> Array:
        """Return points (n, 2) of this segment, moved to another segment of its shape."""
        (here, before), (there, after) = start_frame(self.segment), start_frame(segment)
        flat = np.ascontiguousarray(points).view(complex)
        found: Array = (there + (flat - here) * (after / before)).view(np.float64)
        return found


def start_frame(segment: Segment) -> tuple[complex, complex]:
    """Return the position of the mass and the direction of the body at the start of a segment."""
    return complex(*segment.start[:2]), rect(1.0, segment.turning[0])


def shape_of(segment: Segment) -> Hashable:
    """Return a key of all numbers of a segment in its start frame: two segments that differ only in
    place, direction and start time have equal keys."""
    start, ahead = start_frame(segment)
    own = transformed(segment, -start / ahead, 1 / ahead, -segment.turning[0])
    numbers = [own.t1 - own.t0, *own.turning, *own.start, *own.goal]
    for row in (*own.phases, *own.feet):
        numbers += astuple(row)
    for swing in own.swings:
        numbers += (swing.side, swing.t0, swing.t1, swing.u0, swing.u1, *swing.start, *swing.goal)
    rounded = np.round(numbers, ALIKE) + 0.0  # no -0.0
    return len(own.phases), len(own.feet), rounded.tobytes()


def walked(segment: Segment, limits: Limits) -> Walked:
    """Return the samples of a segment, from the pendulum of its mass and the quintics of its feet,
    with its broken rules."""
    ends = np.cumsum([phase.seconds for phase in segment.phases])
    rests = segment.start == segment.goal and not any(segment.start[2:])
    still = rests and len(segment.phases) == 1
    times = np.sort(np.append(grid(float(ends[-1]), inf if still else STEP), ends[:-1]))
    moved = mass(segment.phases, segment.start, segment.goal, times, limits["omega"])
    swings = segment.swings
    begin, end = np.array([[swing.t0, swing.t1] for swing in swings]).reshape(-1, 2).T
    seconds = end - begin
    paths = np.array([between(s.t1 - s.t0, s.start, s.goal)[:2] for s in swings])
    paths = paths.reshape(-1, 2, 6).transpose(0, 2, 1)
    since = seconds[:, None] * INSTANTS
    powers = since[:, :, None] ** np.arange(6)
    places = powers @ paths
    speeds = powers[:, :, :5] @ (paths[:, 1:] * np.arange(1, 6)[:, None])
    fast = np.hypot(speeds[:, :, 0], speeds[:, :, 1])
    found = Walked(segment, moved, begin[:, None] + since, places, fast, [])
    found.broken.extend(_broken(found, limits))
    return found


def _broken(walked: Walked, limits: Limits) -> Iterator[Broken]:
    segment, path = walked.segment, walked.mass
    gravity = limits["omega"] ** 2 * limits["height"]
    lasting, seconds = sum(phase.seconds for phase in segment.phases), segment.t1 - segment.t0
    missed = {"start": path.late, "goal": path.early}
    if abs(gravity - GRAVITY) > 1e-6:
        yield 0, "gravity", f"a gravity of {gravity:.4f} m/s^2, not {GRAVITY}"
    elif abs(lasting - seconds) > NEAR:
        yield 0, "time", f"phases last {lasting:.4f} s, the segment {seconds:.4f} s"
    elif end := next((end for end, metres in missed.items() if metres > 1e-8), None):
        what = f"the centre of mass misses the {end} of its segment by {missed[end]:.4f} m"
        yield 0, "dynamics", what
    else:
        yield from _friction(path, limits)
        off = next(_support(segment, limits), None)
        yield from _double(segment, limits) if off is None else (off,)
        yield from _stance(segment, path, limits)
        yield from _facing(segment, path.times)
        yield from _steps(segment, limits)
        yield from _swings(segment, walked.speeds, limits)
        yield from _grounded(segment)


def _friction(path: Mass, limits: Limits) -> Iterator[Broken]:
    pull = np.hypot(*(path.states[:, :2] - path.pressures).T) / limits["height"]
    worst = int(pull.argmax())
    if pull[worst] > limits["friction"]:
        what = f"friction of {pull[worst]:.3f} needed, more than {limits['friction']:g}"
        yield float(path.times[worst]), "friction", what


def _support(segment: Segment, limits: Limits) -> Iterator[Broken]:
    """Check that the centre of pressure is always under the grounded feet and never jumps."""
    begin, last = 0.0, segment.phases[0]
    sole = limits["sole_length"] / 2 * INNER, limits["sole_width"] / 2 * INNER
    for phase in segment.phases:
        end = begin + phase.seconds
        down = [f for f in segment.feet if f.down <= begin + NEAR and f.up >= end - NEAR]
        ends = {(phase.x, phase.y), (phase.to_x, phase.to_y)}  # one point while the centre rests
        off = max((_off(down, x, y, sole) for x, y in ends if down), default=inf)
        if begin and hypot(phase.x - last.to_x, phase.y - last.to_y) > NEAR:
            yield begin, "support", "the centre of pressure jumps"
        elif not down:
            yield begin, "support", "no foot is on the ground"
        elif off > NEAR:
            what = f"the centre of pressure is {off:.3f} m outside the feet on the ground"
            yield begin, "support", what
        begin, last = end, phase


def _double(segment: Segment, limits: Limits) -> Iterator[Broken]:
    """Check the share of time with both feet on the ground in a segment that begins and ends on one
    foot, like a walk."""
    lasting = segment.t1 - segment.t0
    ends = [
        sum(foot.down <= t + NEAR and foot.up >= t - NEAR for foot in segment.feet)
        for t in (0.0, lasting)
    ]
    if ends != [1, 1]:
        return
    share = sum(foot.up - foot.down for foot in segment.feet) / lasting - 1
    least, most = limits["least_double"], limits["most_double"]
    if not least - NEAR <= share <= most + NEAR:
        what = f"both feet are on the ground for {share:.3f} of the time, not {least:g} to {most:g}"
        yield 0.0, "double support", what


def _stance(segment: Segment, path: Mass, limits: Limits) -> Iterator[Broken]:
    """Check that the mass stays near each foot that carries it."""
    feet = np.array([(foot.down, foot.up, foot.x, foot.y) for foot in segment.feet])
    down, up, x, y = feet.reshape(-1, 4).T[:, :, None]
    off = np.hypot(path.states[:, 0] - x, path.states[:, 1] - y)
    off[(path.times < down) | (path.times > up)] = 0.0
    if off.max(initial=0.0) > limits["stance"] + NEAR:
        far = f"the mass is {off.max():.3f} m from a foot that carries it"
        t = float(path.times[int(off.max(axis=0).argmax())])
        yield t, "stance", f"{far}, more than {limits['stance']:g}"


def _facing(segment: Segment, times: Array) -> Iterator[Broken]:
    """Check that the body never turns far from the direction of a foot on the ground."""
    yaw = body_yaw(segment, times)
    for foot in segment.feet:
        turned = (yaw[(times >= foot.down) & (times <= foot.up)] - foot.yaw) % tau
        if (most := np.minimum(turned, tau - turned).max(initial=0.0)) > TURNED + NEAR:
            yield foot.down, "feet", f"the body turns {most:.2f} rad from a foot on the ground"


def _off(feet: list[Foothold], x: float, y: float, sole: tuple[float, float]) -> float:
    """Return a point's distance in metres from the area of one or two feet, each with a margin of
    ``sole`` metres ahead and aside."""
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


def _steps(segment: Segment, limits: Limits) -> Iterator[Broken]:
    """Check that the feet land near each other, on their own sides, and turn little."""
    feet = sorted(segment.feet, key=lambda foot: foot.down)
    together = [(a, b) for a, b in combinations(feet, 2) if b.down < a.up + NEAR]
    for before, after in {*pairwise(feet), *together}:
        dx, dy = after.x - before.x, after.y - before.y
        length, turned = hypot(dx, dy), remainder(after.yaw - before.yaw, tau)
        yaw = before.yaw + turned / 2
        aside = after.side * (dy * cos(yaw) - dx * sin(yaw))
        if abs(turned) > TURNED + NEAR:
            what = f"a foot lands {abs(turned):.2f} rad from the direction of the other"
            yield after.down, "feet", what
        if length > limits["step"] + NEAR:
            yield after.down, "step", f"a step of {length:.3f} m, more than {limits['step']:g}"
        if before.side != after.side and aside < limits["aside"] - NEAR:
            what = f"a foot lands {aside:.3f} m beside the other, less than {limits['aside']:g}"
            yield after.down, "feet", what


def _swings(segment: Segment, speeds: Array, limits: Limits) -> Iterator[Broken]:
    """Check that a swing is not too fast, begins and ends at rest on its footholds, and passes the
    end of a segment only if the next segment continues it."""
    for swing, speed in zip(segment.swings, speeds.max(axis=1).tolist(), strict=True):
        if speed > limits["swing"] + NEAR:
            what = f"a foot swings at {speed:.2f} m/s, more than {limits['swing']:g}"
            yield swing.t0, "swing", what
        into, out = swing.t0 < NEAR, swing.t1 > segment.t1 - segment.t0 - NEAR
        whole = (into or swing.u0 == 0) and (out or swing.u1 == 1)
        if not (whole and 0 <= swing.u0 < swing.u1 <= 1):
            yield swing.t0, "feet", "a foot is in the air where its step begins or ends"
        mine = [foot for foot in segment.feet if foot.side == swing.side]
        lifted = [foot for foot in mine if abs(foot.up - swing.t0) < NEAR]
        landed = [foot for foot in mine if abs(foot.down - swing.t1) < NEAR]
        for word, above, feet, state in (
            ("leaves", swing.u0, lifted, swing.start),
            ("reaches", 1.0 - swing.u1, landed, swing.goal),
        ):
            if abs(above) > NEAR:
                continue  # in mid-swing at a walking pose: the next segment continues it
            apart = min((hypot(f.x - state[0], f.y - state[1]) for f in feet), default=None)
            turned = min((abs(f.yaw - state[2]) for f in feet), default=0.0)
            if turned > NEAR or max(map(abs, state[3:6])) > NEAR:
                what = f"a foot {word} the ground as it moves, or {turned:.3f} rad off its foothold"
                yield swing.t0, "feet", what
            if apart is None:
                yield swing.t0, "feet", f"a foot {word} the ground where it has no foothold"
            elif apart > NEAR:
                what = f"a swinging foot {word} the ground {apart:.3f} m from its foothold"
                yield swing.t0, "feet", what


def _grounded(segment: Segment) -> Iterator[Broken]:
    """Check that each of the two feet is either on the ground or in the air."""
    if wrong := {*(f.side for f in segment.feet), *(s.side for s in segment.swings)} - {1, -1}:
        yield 0.0, "feet", f"a foot has side {min(wrong)}; expected 1 (left) or -1 (right)"
    for side, foot in ((1, "left"), (-1, "right")):
        spans = [(f.down, f.up, True) for f in segment.feet if f.side == side]
        spans += [(s.t0, s.t1, False) for s in segment.swings if s.side == side]
        spans.sort()
        if jump := next((b for a, b in pairwise(spans) if a[2] is b[2]), None):
            yield jump[0], "feet", "a foot has two footholds or two swings in succession"
        reached = 0.0
        for begin, end, _ in spans:
            if not end > begin:
                yield begin, "feet", "a foot is on the ground for no time"
            if abs(begin - reached) > NEAR:
                what = "is recorded twice" if begin < reached else "has no position"
                yield begin, "feet", f"the {foot} foot {what}"
                return
            reached = end
        if abs(reached - (segment.t1 - segment.t0)) > NEAR:
            yield reached, "feet", f"the {foot} foot has no position"
            return
