"""Pushes of a walker, one in each walking move at a random instant, and recovery: it replans its
remaining footsteps, and leans on its foot.

The rest of a move is the same linear problem as a whole one (safenav.motion.pendulum), from the
state after the push to the same goal, now with bounds: the centre of pressure stays within the
foot, steps keep their length and their side, feet stay in the regions of the move, and a swinging
foot can only be redirected as far as time allows. A small quadratic programme finds the least
change: its unknowns are, for each phase, the offset of its foot from the plan and of the centre of
pressure from its foot. If too few steps are left to meet the goal exactly, the walker comes as near
as it can, and the next move starts there.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from itertools import pairwise, product, zip_longest
from math import cos, hypot, pi, sin

import numpy as np
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.motion.file.records import BodyPush, Foothold, Line, PressurePhase, Segment, Swing
from safenav.motion.geometry import MetricFloor
from safenav.motion.pendulum import Array, advanced, miss, state_of
from safenav.motion.polynomial import between, derivative, values
from safenav.motion.solver import solution
from safenav.motion.walker.courses import Actual, PendingMove, WalkPlan, plan_of
from safenav.motion.walker.cutting import split
from safenav.motion.walker.mover import LIMITS

EXACT = 1e-9
"""Tolerance for meeting the plan, in metres and metres per second."""
FIRST = 0.02
"""Seconds from either end of a move without a push."""


def pushed(
    segments: Sequence[Segment], floor: MetricFloor, omega: float, push: float, seed: str
) -> list[Line]:
    """The segments of one walker with a push of up to ``push`` m/s in each walking move, and the
    pushes. Raises UsageError if it cannot keep itself up."""
    chance = random.Random(seed)
    found: list[Line] = []
    actual: Actual | None = None
    courses = [PendingMove(s, floor.corridor(s.origin, s.to)) for s in segments]
    for course, following in zip_longest(courses, courses[1:]):
        planned = segment = course.segment
        if planned.primitive in ("stop", "stand"):
            following = None
        if actual is not None:
            segment = recovered(course, actual, following, omega)
        if planned.primitive.startswith("walk"):
            instant = chance.uniform(FIRST, segment.t1 - segment.t0 - FIRST)
            angle, size = chance.uniform(0, 2 * pi), push * chance.uniform(0, 1) ** 0.5
            blow = (size * cos(angle), size * sin(angle))
            here = PendingMove(segment, course.box)
            first, hit, segment = struck(here, following, instant, blow, omega)
            found += [first, hit]
        found.append(segment)
        actual = _left(segment, planned)
    return found


def struck(
    course: PendingMove,
    following: PendingMove | None,
    instant: float,
    blow: tuple[float, float],
    omega: float,
) -> tuple[Segment, BodyPush, Segment]:
    """A move until a push that changes the velocity (m/s), the push, and the move from there."""
    first, second = split(course.segment, instant, omega)
    state = np.array(first.goal) + np.array([0.0, 0.0, *blow])
    foot = next(foot for foot in second.feet if foot.down <= 0.0)
    actual = Actual(state, (foot.x, foot.y))
    second = recovered(PendingMove(second, course.box), actual, following, omega)
    return first, BodyPush(second.robot, second.tick, second.t0, *blow), second


def _left(segment: Segment, planned: Segment) -> Actual | None:
    """Return the walker's position after a move, if it differs from the plan."""
    foot, wanted = segment.feet[-1], planned.feet[-1]
    off = np.abs(np.subtract(segment.goal, planned.goal)).max()
    if max(float(off), abs(foot.x - wanted.x), abs(foot.y - wanted.y)) < EXACT:
        return None
    return Actual(np.array(segment.goal), (foot.x, foot.y))


AHEAD, ASIDE = 0.0599, 0.0299
"""Metres by which the centre of pressure may leave the middle of a foot, lengthwise and across."""
BESIDE = 0.17
"""The same across both feet, when both are on the ground."""
STEP, LATERAL = 0.645, 0.151
"""Longest step and least lateral distance of the feet in metres."""
DIRECTIONS = 24
"""Sides of the polygon that stands for the circle of the longest step."""
EDGE = 0.12
"""Least distance in metres of a foot's middle from the border of its regions."""
FARTHEST = 0.25
"""Metres by which a foot may be placed off its plan."""
HURRY = 1.0
"""Metres by which a foot in the air may be redirected, per second left before it lands."""
LEAN, DIVERGENT, CONVERGENT = 0.5, 400.0, 20.0
"""Costs of leaning (relative to those of moving a foot), and of missing the goal."""
EQUAL = 5


def replaced(plan: WalkPlan, state: Array, omega: float, soft: bool) -> tuple[Array, Array] | None:
    """Offsets of the feet and of the centres of pressure (phases, 2 each); None if there are
    none. ``soft``: the goal may be missed, and the last foot be placed elsewhere."""
    count = len(plan.durations)
    missed, effect = miss(plan.durations, plan.pressures, state, plan.goal, omega)
    last = plan.same[-1]
    moved = [
        i
        for i in range(1, count)
        if plan.same[i] == i and (i not in plan.fixed or (soft and i == last))
    ]
    first_of = {phase: 2 * at for at, phase in enumerate(moved)}
    places = {i: first_of[plan.same[i]] for i in range(count) if plan.same[i] in first_of}
    leans = 2 * len(moved)
    misses = leans + 2 * count
    size = misses + (4 if soft else 0)
    cost = np.concatenate([np.ones(leans), np.full(2 * count, LEAN)])
    if soft:
        cost = np.concatenate([cost, [DIVERGENT, CONVERGENT] * 2])
    bound = np.zeros(size)
    turns = [_turned(foot or plan.feet[0]) for foot in plan.feet]
    for phase, at in places.items():
        reach = min(FARTHEST, HURRY * plan.lift) if phase == 1 else FARTHEST
        bound[at : at + 2] = reach
    for phase, foot in enumerate(plan.feet):
        at = leans + 2 * phase
        bound[at : at + 2] = (AHEAD, ASIDE) if foot is not None else (AHEAD, BESIDE)
    bound[misses:] = 1e30
    rows = np.zeros((4, size))
    for phase in range(count):
        lean = turns[phase]
        for axis in (0, 1):
            for row, share in ((axis, effect.diverging), (2 + axis, effect.converging)):
                if phase in places:
                    rows[row, places[phase] + axis] += share[phase]
                at = leans + 2 * phase
                rows[row, at : at + 2] += share[phase] * lean[axis]
    if soft:
        for axis in (0, 1):
            rows[axis, misses + 2 * axis] = effect.decay
            rows[2 + axis, misses + 2 * axis + 1] = -1.0
    scale = np.array([1 / max(effect.diverging.max(), 1e-9)] * 2 + [1.0, 1.0])
    rows, wanted = rows * scale[:, None], missed.ravel() * scale
    sides, most = _steps(plan, places, size)
    rows_all = np.vstack([rows, sides])
    upper = np.concatenate([bound, wanted, most])
    lower = np.concatenate([-bound, wanted, np.full(len(most), -1e30)])
    sense = np.zeros(len(upper), dtype=np.int32)
    sense[size : size + 4] = EQUAL
    posed = np.diag(cost), np.zeros(size), rows_all, upper, lower, sense
    found = solution("recovery from pushes", *posed)
    if found is None:
        return None
    offsets, pushes = np.zeros((count, 2)), np.zeros((count, 2))
    for phase, at in places.items():
        offsets[phase] = found[at : at + 2]
    for phase in range(count):
        at = leans + 2 * phase
        pushes[phase] = turns[phase] @ found[at : at + 2]
    return offsets, pushes


def _turned(foot: Foothold | None) -> Array:
    yaw = foot.yaw if foot is not None else 0.0
    return np.array([[cos(yaw), -sin(yaw)], [sin(yaw), cos(yaw)]])


def _steps(plan: WalkPlan, places: dict[int, int], size: int) -> tuple[Array, Array]:
    """Rows and upper bounds: lateral order, longest step, and the corridor."""
    rows: list[Array] = []
    most: list[float] = []

    def add(direction: Array, after: int, before: int | None, limit: float) -> None:
        row = np.zeros(size)
        if after in places:
            row[places[after] : places[after] + 2] += direction
        if before is not None and before in places:
            row[places[before] : places[before] + 2] -= direction
        if row.any():
            rows.append(row)
            most.append(limit)

    for phase, (one, other) in enumerate(pairwise(plan.feet), start=1):
        if one is None or other is None or plan.same[phase] != phase:
            continue
        box = plan.boxes[phase]
        step = np.array([other.x - one.x, other.y - one.y])
        yaw = (one.yaw + other.yaw) / 2
        across = np.array([-sin(yaw), cos(yaw)]) * other.side
        add(-across, phase, phase - 1, float(across @ step) - LATERAL)
        for part in range(DIRECTIONS):
            angle = 2 * pi * part / DIRECTIONS
            direction = np.array([cos(angle), sin(angle)])
            add(direction, phase, phase - 1, STEP * cos(pi / DIRECTIONS) - float(direction @ step))
        for direction, limit in (
            (np.array([1.0, 0.0]), box.east - EDGE - other.x),
            (np.array([-1.0, 0.0]), other.x - box.west - EDGE),
            (np.array([0.0, 1.0]), box.north - EDGE - other.y),
            (np.array([0.0, -1.0]), other.y - box.south - EDGE),
        ):
            add(direction, phase, None, limit)
    if not rows:
        return np.zeros((0, size)), np.zeros(0)
    return np.array(rows), np.array(most)


EARLY = 0.2
"""Seconds before landing within which it is also tried not to redirect the foot."""
SOONER = (0.0, 0.08, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.24, 0.32, 0.4, -0.03, -0.08, -0.16)
"""Seconds by which a foot may land earlier (later if negative), in the order of trying."""
SWING = 2.99
"""Metres per second of the fastest swing."""
LEG = 0.55
"""Greatest distance in metres of the mass from the centre of pressure: the reach of a leg."""


def recovered(
    course: PendingMove, actual: Actual, following: PendingMove | None, omega: float
) -> Segment:
    """The move from the actual state at its start. Raises UsageError.

    With too few steps left to reach its goal it leaves the rest to the move that follows: the
    goal of the result is where it really ends, and the move that follows can continue from there.
    """
    segment = course.segment
    for found in _candidates(course, actual, following, omega):
        if following is None or _goes_on(found, segment, following, omega):
            return found
    raise UsageError(
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
    """Return the segment with these offsets; None if they exceed the length of a leg or of a step,
    or the speed of a foot."""
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
