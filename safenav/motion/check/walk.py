"""The steps of a walker: its motion during a segment, and the rules of segments: the pendulum of
its mass, and feet that support it."""

from cmath import rect
from collections.abc import Callable, Mapping
from itertools import combinations, pairwise
from math import ceil, cos, hypot, inf, pi, remainder, sin, tau

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.file import Foothold, Segment
from safenav.motion.geometry import Mass, between, mass

Array = NDArray[np.float64]

STEP = 0.02
"""Seconds between samples of a body."""
LEAST = 50
"""The fewest samples of a swing, so that its foot cannot leave them far aside."""
MOST_SAMPLES = 5_000_000
"""Samples of one piece of motion: more than a day."""


NEAR = 1e-7
"""Tolerance for the rounding of a file, in metres, seconds and radians."""


def grid(seconds: float, step: float = STEP) -> Array:
    """Return times from 0 to the end, at most a step apart.

    Raises UsageError for a duration that no file of safenav has: its samples would fill the memory.
    """
    if not seconds < MOST_SAMPLES * STEP:
        most = f"expected at most {MOST_SAMPLES * STEP:,.0f} s"
        raise UsageError(f"the motion has a piece of {seconds:,.0f} s; {most}")
    count = max(1, ceil(seconds / step))
    return np.arange(count + 1, dtype=np.float64) * (seconds / count)


class Walked(Struct, frozen=True):
    """A walker during a segment, at most ``STEP`` apart: its ``mass``, also at the ends of its
    phases; of its feet in the air times since the segment's start (swings, n), ``places`` (swings,
    n, 2) and ``speeds`` (swings, n); the rules that are ``broken``: seconds since the start, rule,
    and what was found."""

    segment: Segment
    mass: Mass
    times: Array
    places: Array
    speeds: Array
    broken: list[tuple[float, str, str]]

    def moved(self, segment: Segment, points: Array) -> Array:
        """Return points (n, 2) of this segment as those of another one of its shape."""
        (here, before), (there, after) = start_frame(self.segment), start_frame(segment)
        flat = np.ascontiguousarray(points).view(complex)
        found: Array = (there + (flat - here) * (after / before)).view(np.float64)
        return found


ALIKE = 9
"""Decimals (metres, seconds, radians) in which segments of one shape are equal."""


def start_frame(segment: Segment) -> tuple[complex, complex]:
    """Return where the mass is at the start of a segment, and the direction in which its body faces
    then."""
    return complex(*segment.start[:2]), rect(1.0, segment.turning[0])


def shape_of(segment: Segment) -> bytes:
    """Return all numbers of a segment in its start frame: equal for segments that differ only in
    their place, direction and time."""
    lists = segment.phases, segment.feet, segment.swings
    rest = [*map(len, lists), segment.t1 - segment.t0, *segment.turning[2:]]
    points, ways, yaws = (
        [*segment.goal[:2]],
        [*segment.start[2:], *segment.goal[2:]],
        [*segment.turning[:2]],
    )
    for phase in segment.phases:
        points += (phase.x, phase.y, phase.to_x, phase.to_y)
        rest.append(phase.seconds)
    for foot in segment.feet:
        points += (foot.x, foot.y)
        yaws.append(foot.yaw)
        rest += (foot.side, foot.down, foot.up)
    for swing in segment.swings:
        rest += (swing.side, swing.t0, swing.t1, swing.u0, swing.u1)
        for x, y, yaw, east, north, turning, *pull, bending in (swing.start, swing.goal):
            points += (x, y)
            ways += (east, north, *pull)
            yaws.append(yaw)
            rest += (turning, bending)
    start, ahead = start_frame(segment)
    local = (
        np.array(points, dtype=float).view(complex) - start,
        np.array(ways, dtype=float).view(complex),
    )
    numbers = np.concatenate(
        [*((each / ahead).view(float) for each in local), np.array(yaws) - yaws[0], rest]
    )
    return (np.round(numbers, ALIKE) + 0.0).tobytes()


def walked(segment: Segment, limits: Mapping[str, float], *, cut: bool = False) -> Walked:
    """Solve the pendulum of a segment, and the quintics of its feet; check the rules of segments.
    ``cut``: it was cut off."""
    ends = np.cumsum([phase.seconds for phase in segment.phases])
    rests = segment.start == segment.goal and not any(segment.start[2:])
    still = rests and len(segment.phases) == 1
    times = np.sort(np.append(grid(float(ends[-1]), inf if still else STEP), ends[:-1]))
    moved = mass(segment.phases, segment.start, segment.goal, times, limits["omega"])
    swings = segment.swings
    begin, end = np.array([[swing.t0, swing.t1] for swing in swings]).reshape(-1, 2).T
    seconds = end - begin
    longest = float(seconds.max(initial=STEP))
    u = grid(longest, min(STEP, longest / LEAST)) / longest
    paths = np.array([between(s.t1 - s.t0, s.start, s.goal)[:2] for s in swings])
    paths = paths.reshape(-1, 2, 6).transpose(0, 2, 1)
    powers = (seconds[:, None] * u)[:, :, None] ** np.arange(6)
    places = powers @ paths
    speeds = powers[:, :, :5] @ (paths[:, 1:] * np.arange(1, 6)[:, None])
    fast = np.hypot(speeds[:, :, 0], speeds[:, :, 1])
    found = Walked(segment, moved, begin[:, None] + seconds[:, None] * u, places, fast, [])
    _check(found, limits, lambda *wrong: found.broken.append(wrong), cut=cut)
    return found


GRAVITY = 9.81
TURNED = pi / 4
"""The most by which one foot lands turned against the other, in radians."""
INNER = 0.6
"""Share of a sole, around its middle, in which the centre of pressure stays."""

Wrong = Callable[[float, str, str], None]


def _check(walked: Walked, limits: Mapping[str, float], wrong: Wrong, *, cut: bool) -> None:
    segment = walked.segment
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
        ends = {(phase.x, phase.y), (phase.to_x, phase.to_y)}  # the same while it rests
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
    feet = sorted(segment.feet, key=lambda foot: foot.down)
    together = [(a, b) for a, b in combinations(feet, 2) if b.down < a.up + NEAR]
    for before, after in {*pairwise(feet), *together}:
        dx, dy = after.x - before.x, after.y - before.y
        length = hypot(dx, dy)
        turned = abs(remainder(after.yaw - before.yaw, tau))
        if turned > TURNED + NEAR:
            wrong(after.down, "feet", f"a foot lands {turned:.2f} rad turned against the other")
        if length > limits["step"] + NEAR:
            wrong(after.down, "step", f"a step of {length:.3f} m, more than {limits['step']:g}")
        if before.side == after.side:
            continue
        yaw = before.yaw + remainder(after.yaw - before.yaw, tau) / 2
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
        spans = [(f.down, f.up, True) for f in segment.feet if f.side == side]
        spans += [(s.t0, s.t1, False) for s in segment.swings if s.side == side]
        spans.sort()
        if jump := next((b for a, b in pairwise(spans) if a[2] is b[2]), None):
            wrong(jump[0], "feet", "a foot moves on while it is on the ground, or in the air")
        reached = 0.0
        for begin, end, _ in spans:
            if not end > begin:
                wrong(begin, "feet", "a foot is on the ground for no time")
            if abs(begin - reached) > NEAR:
                what = "is recorded twice" if begin < reached else "has no position"
                foot = "left" if side == 1 else "right"
                wrong(begin, "feet", f"the {foot} foot {what}")
                return
            reached = end
        if abs(reached - (segment.t1 - segment.t0)) > NEAR:
            wrong(reached, "feet", f"the {'left' if side == 1 else 'right'} foot has no position")
            return
