"""The gait of a walker on regions of a given side, with keyframes and their times.

Local frame: the walker enters its region at the origin and heads along x. Sources: Zhao, Fernandez,
Sentis (IJRR 2017) for the time of a step between two keyframes; docs/motion.md.
"""

from functools import lru_cache
from itertools import pairwise
from math import asinh, ceil, cos, cosh, exp, log, pi, sin, sqrt

from msgspec import Struct

from safenav.errors import UsageError

GRAVITY = 9.81
LEFT = 1

LEAST_SIDE = 1.65
"""Minimum side of a region in metres; below it, a slow walker cannot turn."""
LONGEST_STEP = 0.5
FULL_STEP = 0.45
"""Step length in metres at full speed; shorter steps are proportionally slower."""
FASTEST = 0.46
"""Maximum speed at apex in m/s; at a higher one, the feet would swing too fast in a turn."""
LONGEST_ARC = 2

ARC_STEPS = 4
FULL_SPEED = 0.45
ARC_SPEEDS = {2: (0.3, 0.4, 0.4, 0.5), 1: (0.3, 0.25, 0.25, 0.5)}
"""Apex speeds in m/s at ``FULL_SPEED`` on the arc, by its radius in step lengths."""
ARC_SHARES = {2: (0.7, 1.15), 1: (1.0, 1.15)}
"""Shares of the chord for the first and last step of an arc."""
START_SPEED = 0.15
"""Speed over the first foot, in m/s."""
SHIFT_SECONDS = 0.3
"""Half of the double support in which the mass leans before the first step, in seconds."""
SETTLE_SECONDS = 0.6
"""Half of the double support in which the mass comes to rest, in seconds."""


class Walker(Struct, frozen=True):
    """The parameters of a walker, in metres, seconds and metres per second.

    ``foot``: distance of each foot from the centre line; ``speed``: maximum speed at apex;
    ``size``: diameter of a circle around the body, seen from above.
    """

    size: float = 0.6
    speed: float = 0.45
    height: float = 0.8
    foot: float = 0.18


class Gait(Struct, frozen=True):
    """The periodic gait of a walker on regions of one size.

    A straight move takes ``steps`` (even, so that each move ends on its first foot) of ``length``
    metres and ``seconds`` each. At apex the mass moves at ``speed`` and is ``sway`` metres off the
    centre line, towards the stance foot.
    """

    walker: Walker
    side: float
    steps: int
    length: float
    speed: float
    omega: float
    seconds: float
    sway: float

    def approach(self, spent: int) -> int:
        """Return the number of straight steps before a turn's arc, which leaves room for the
        longest radius (``LONGEST_ARC`` steps). ``spent``: completed steps in the region."""
        return max(0, self.steps // 2 - spent - LONGEST_ARC)


def least_side_of(side: float, walker: Walker) -> float:
    """Return the minimum side in metres of regions of about ``side`` metres for a turn's arc and
    the body."""
    return max(LEAST_SIDE, walker.size * _steps(side) / 2)


def _steps(side: float) -> int:
    """Return the number of steps across a region."""
    return max(6, 2 * ceil(side / LONGEST_STEP / 2 - 1e-9))


def gait_on(side: float, walker: Walker) -> Gait:
    """Return the gait on regions of ``side`` metres. Raises UsageError if they are too small."""
    omega = frequency(walker.height)
    if side < (need := least_side_of(side, walker)):
        raise UsageError(
            f"a walker of {walker.size:g} m cannot walk on regions of {side:g} m: a turn needs "
            f"room for an arc and its body, {need:g} m\n"
            "    give the map a larger 'resolution', or the model another 'motion'"
        )
    steps = _steps(side)
    length = side / steps
    speed = min(walker.speed, FASTEST) * min(1.0, length / FULL_STEP)
    # Half a period after apex the mass is half a step ahead of the foot (pendulum in x and y).
    seconds = 2 / omega * asinh(omega * length / (2 * speed))
    sway = walker.foot * (1 - 1 / cosh(omega * seconds / 2))
    return Gait(walker, side, steps, length, speed, omega, seconds, sway)


def frequency(height: float) -> float:
    """Return omega (1/s) of a pendulum with its mass ``height`` metres above the ground."""
    return sqrt(GRAVITY / height)


def step_times(
    omega: float, speed: float, foot: float, apex: float, apex_speed: float
) -> tuple[float, float]:
    """Return the two durations (seconds) of a step between keyframes: on the foot at ``foot``,
    while the mass moves from 0 at ``speed``, and on the foot at ``apex``, which it passes at
    ``apex_speed`` (m, m/s). The two curves of the phase plane intersect once."""
    square = apex_speed**2 - speed**2 + omega**2 * apex**2
    switch = square / (2 * omega**2 * (apex - foot))
    fastest = sqrt(apex_speed**2 + omega**2 * (switch - apex) ** 2) / omega
    first = log((switch - foot + fastest) / (speed / omega - foot)) / omega
    return first, log((apex - switch + fastest) / (apex_speed / omega)) / omega


class Apex(Struct, frozen=True):
    """A keyframe of the centre line: position, heading, speed and stance foot."""

    x: float
    y: float
    yaw: float
    speed: float
    foot: int

    def stance(self, offset: float) -> tuple[float, float]:
        """Return the point ``offset`` metres off the centre line, on the stance foot's side."""
        aside = self.foot * offset
        return self.x - aside * sin(self.yaw), self.y + aside * cos(self.yaw)


def _straight(line: list[Apex], gait: Gait, steps: int, speed: float) -> None:
    """Append steps straight ahead whose speed changes evenly to ``speed``."""
    first = line[-1]
    for step in range(1, steps + 1):
        share = step / steps
        pace = first.speed + (speed - first.speed) * share
        x = first.x + step * gait.length
        line.append(Apex(x, first.y, first.yaw, pace, -line[-1].foot))


def _turned(line: list[Apex], gait: Gait, turn: int, approach: int) -> None:
    """Append a quarter turn: straight steps, an arc, and a tail to the next walking pose."""
    _straight(line, gait, approach, line[0].speed)
    first = line[-1]
    half, length = gait.side / 2, gait.length
    radius = half - first.x
    size = max(1, round(radius / length))
    early, late = ARC_SHARES[size]
    chord = 2 * radius * sin(pi / 4 / ARC_STEPS)
    quarter = pi / 2 / ARC_STEPS
    pace = gait.speed / FULL_SPEED
    x, y = first.x, first.y
    for step, share in enumerate((early, 2 - early, 2 - late, late)):
        middle = (step + 0.5) * quarter
        x += chord * share * cos(middle)
        y += chord * share * sin(middle) * turn
        speed = ARC_SPEEDS[size][step] * pace
        line.append(Apex(x, y, (step + 1) * quarter * turn, speed, -line[-1].foot))
    last = line[-1]
    steps = round((half + length - radius) / length)
    end = (half, turn * (half + length))
    for step in range(1, steps + 1):
        share = step / steps
        there = (last.x + (end[0] - last.x) * share, last.y + (end[1] - last.y) * share)
        line.append(Apex(*there, turn * pi / 2, gait.speed, -line[-1].foot))


class Stride(Struct, frozen=True):
    """The keyframes of a move and the seconds on each foot, from half a step before its apex to
    half a step after it. ``lean``: seconds in which a standing walker leans before."""

    line: tuple[Apex, ...]
    durations: tuple[float, ...]
    lean: float = 0.0

    @property
    def seconds(self) -> float:
        return self.lean + sum(self.durations)

    @property
    def foot(self) -> int:
        """The stance foot at the end."""
        return self.line[-1].foot


@lru_cache(maxsize=512)
def walking(gait: Gait, turn: int, foot: int) -> Stride:
    """Return the stride from a walking pose, with ``foot`` on the ground, to one in the next
    region. ``turn``: quarter turns to the left."""
    line = [Apex(gait.length, 0.0, 0.0, gait.speed, foot)]
    if turn == 0:
        _straight(line, gait, gait.steps, gait.speed)
    else:
        approach = gait.approach(1)
        if (approach % 2 == 0) != (foot == turn):
            approach += 1  # the outer foot then swings first on the arc
        _turned(line, gait, turn, approach)
    return Stride(tuple(line), _durations(gait, line))


@lru_cache(maxsize=512)
def starting(gait: Gait, turn: int, foot: int) -> Stride:
    """Return the stride from a standing pose to a walking pose in the next region. ``foot``: the
    stance foot at the end of a straight start (a turn determines it)."""
    room = gait.approach(2)
    first = -foot if turn == 0 else turn * (-1) ** room
    line = [Apex(2 * gait.length, 0.0, 0.0, min(START_SPEED, gait.speed), first)]
    if turn == 0:
        _straight(line, gait, gait.steps - 1, gait.speed)
    else:
        _turned(line, gait, turn, room)
    return Stride(tuple(line), _durations(gait, line), 2 * SHIFT_SECONDS)


@lru_cache(maxsize=64)
def stopping(gait: Gait) -> tuple[float, float, float, float]:
    """Return the seconds of the four parts of a stop: the step onto the capture point, the closing
    of the feet, and two equal parts in which the mass settles."""
    omega, offset = gait.omega, gait.walker.foot
    step = log(gait.length * omega / gait.speed) / omega
    lean = offset - (offset - gait.sway) * exp(omega * step)
    close = log(offset / (offset + lean)) / omega
    return step, close, SETTLE_SECONDS, SETTLE_SECONDS


def _durations(gait: Gait, line: list[Apex]) -> tuple[float, ...]:
    seconds = [0.0] * len(line)
    for index, (here, there) in enumerate(pairwise(line)):
        x, y = cos(there.yaw), sin(there.yaw)
        body = here.stance(gait.sway)
        speed = here.speed * cos(there.yaw - here.yaw)
        stance, reach = (
            (east - body[0]) * x + (north - body[1]) * y
            for east, north in (a.stance(gait.walker.foot) for a in (here, there))
        )
        on_this, on_next = step_times(gait.omega, speed, stance, reach, there.speed)
        seconds[index] += on_this
        seconds[index + 1] += on_next
    return tuple(seconds)
