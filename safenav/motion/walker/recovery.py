"""Recovery after a push: a walker replans its remaining footsteps, and leans on its foot.

The rest of a move is the same linear problem as a whole one (safenav.motion.pendulum), from the
state after the push to the same goal, now with bounds: the centre of pressure stays within the
foot, steps keep their length and their side, feet stay in the regions of the move, and a swinging
foot can only be sent where it gets in time. A small quadratic programme finds the least change.
Where so few steps are left that the goal cannot be met exactly, the walker comes as near as it
can, and the next move sets out from there.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise, product
from math import hypot

import numpy as np
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.motion.file.records import Foothold, PressurePhase, Segment, Swing
from safenav.motion.pendulum import Array, advanced, state_of
from safenav.motion.polynomial import between, derivative, values
from safenav.motion.walker.courses import Actual, PendingMove, WalkPlan, plan_of
from safenav.motion.walker.footstep_replanning import replaced
from safenav.motion.walker.limits import LIMITS

EARLY = 0.2
"""Seconds before landing until which there is no need to try that."""
SOONER = (0.0, 0.08, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.24, 0.32, 0.4, -0.03, -0.08, -0.16)
"""Seconds by which a foot may land earlier (later if negative), in the order of trying."""
SWING = 2.99
"""Metres per second of the fastest swing."""
LEG = 0.55
"""Metres of the mass from the centre of pressure at which a leg is too short."""


class FallenError(UsageError):
    """No placing of the feet keeps the walker up."""


def recovered(
    course: PendingMove, actual: Actual, following: PendingMove | None, omega: float
) -> Segment:
    """The move from the actual state at its start. Raises FallenError.

    With too few steps left to reach its goal it leaves the rest to the move that follows: the
    goal of the result is where it really ends, and the move that follows can continue from there.
    """
    segment = course.segment
    for found in _candidates(course, actual, following, omega):
        if following is None or _goes_on(found, segment, following, omega):
            return found
    raise FallenError(
        f"{segment.robot} falls at t = {segment.t0:.2f} s: no footsteps keep it upright\n"
        "    reduce --push"
    )


def _candidates(
    course: PendingMove, actual: Actual, following: PendingMove | None, omega: float
) -> Iterator[Segment]:
    """Ways to carry out the rest of a move, those that change least first."""
    segment = course.segment
    reach = [[course]] if following is None else [[course], [course, following]]
    held = (False, True) if segment.phases[0].seconds < EARLY else (False,)
    for soft in (False, True) if segment.primitive != "stop" else (False,):
        for sooner, step, courses, hold in product(SOONER, (0, 1), reach, held):
            if sooner == 0.0 and step == 1:
                continue
            plan = plan_of(courses, actual, sooner, step, hold)
            found = None if plan is None else replaced(plan, actual.state, omega, soft)
            if plan is not None and found is not None:
                carried = _carried_out(segment, plan, actual, *found, omega)
                if carried is not None:
                    yield carried


def _goes_on(found: Segment, planned: Segment, following: PendingMove, omega: float) -> bool:
    """Whether the move that follows can be walked from where this one ends."""
    last, wanted = found.feet[-1], planned.feet[-1]
    if (found.goal, last.x, last.y) == (planned.goal, wanted.x, wanted.y):
        return True
    actual = Actual(np.array(found.goal), (last.x, last.y))
    return next(_candidates(following, actual, None, omega), None) is not None


def _carried_out(
    segment: Segment, plan: WalkPlan, actual: Actual, offsets: Array, pushes: Array, omega: float
) -> Segment | None:
    """The segment with its feet so placed; None if a leg is too short for it, a step too long, or
    a foot cannot swing so fast."""
    count = len(segment.phases)
    durations = plan.durations[:count]
    pressures = (plan.pressures + offsets + pushes)[:count]
    state = actual.state
    for seconds, pressure in zip(durations, pressures, strict=True):
        for share in (0.0, 0.5, 1.0):
            there = advanced(state, pressure, float(seconds) * share, omega)
            if float(np.hypot(*(there[:2] - pressure))) > LEG:
                return None
        state = advanced(state, pressure, float(seconds), omega)
    before = np.cumsum([0.0, *(phase.seconds for phase in segment.phases)])
    after = np.cumsum([0.0, *durations])

    def when(time: float) -> float:
        at = int(np.abs(before - time).argmin())
        return float(after[at]) if abs(before[at] - time) < 1e-9 else time

    feet = []
    for index, foot in enumerate(segment.feet):
        base = plan.feet[index] if index < count else None
        if base is not None:
            dx, dy = offsets[index].tolist()
            foot = replace(foot, x=base.x + dx, y=base.y + dy)
        foot = replace(foot, down=when(foot.down), up=when(foot.up))
        feet.append(foot)
    if any(hypot(b.x - a.x, b.y - a.y) > LIMITS.step for a, b in pairwise(feet)):
        return None
    phases = tuple(
        PressurePhase(float(seconds), float(x), float(y))
        for seconds, (x, y) in zip(durations, pressures, strict=True)
    )
    wanted = np.array(segment.goal)
    exact = float(np.abs(state - wanted).max()) < 1e-7
    goal = wanted if exact else state
    moved = []
    for swing in segment.swings:
        sent = _resent(swing, segment, feet)
        sent = replace(sent, t0=when(swing.t0), t1=when(swing.t1))
        if _speed(sent) > SWING:
            return None
        moved.append(sent)
    return replace(
        segment,
        phases=phases,
        feet=tuple(feet),
        swings=tuple(moved),
        start=state_of(actual.state),
        goal=state_of(goal),
    )


def _resent(swing: Swing, segment: Segment, feet: list[Foothold]) -> Swing:
    """A swing between the footholds as they are now."""
    start, goal = swing.start, swing.goal
    for before, after in zip(segment.feet, feet, strict=True):
        if before.side != swing.side:
            continue
        if swing.u0 == 0.0 and abs(before.up - swing.t0) < 1e-9:
            start = (after.x, after.y, *start[2:])
        if swing.u1 == 1.0 and abs(before.down - swing.t1) < 1e-9:
            goal = (after.x, after.y, *goal[2:])
    return replace(swing, start=start, goal=goal)


def _speed(swing: Swing) -> float:
    times = np.linspace(0.0, swing.t1 - swing.t0, 30)
    x, y, _ = between(swing.t1 - swing.t0, swing.start, swing.goal)
    return float(np.hypot(values(derivative(x), times), values(derivative(y), times)).max())
