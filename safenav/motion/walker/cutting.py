"""Splitting of a walker's segment at an instant within it."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from safenav.motion.file.records import PressurePhase, Segment, Swing
from safenav.motion.pendulum import advanced, state_of
from safenav.motion.polynomial import between, derivative, values


def split(segment: Segment, at: float, omega: float) -> tuple[Segment, Segment]:
    """Return a segment before and after an instant within it (seconds since its start)."""
    state = np.array(segment.start)
    phases: tuple[list[PressurePhase], list[PressurePhase]] = ([], [])
    begin = 0.0
    for phase in segment.phases:
        end = begin + phase.seconds
        here = np.array([phase.x, phase.y])
        if begin < at:
            lasting = min(end, at) - begin
            phases[0].append(replace(phase, seconds=lasting))
            state = advanced(state, here, lasting, omega)
        if end > at:
            phases[1].append(replace(phase, seconds=end - max(begin, at)))
        begin = end
    early, late = segment.feet, segment.feet
    swings: tuple[list[Swing], list[Swing]] = ([], [])
    for swing in segment.swings:
        one, other = _cut(swing, at)
        swings[0].extend(one)
        swings[1].extend(other)
    before, after, begin_turn, end_turn = segment.turning
    instant = segment.t0 + at
    first = replace(
        segment,
        t1=instant,
        phases=tuple(phases[0]),
        feet=tuple(replace(f, up=min(f.up, at)) for f in early if f.down < at),
        swings=tuple(swings[0]),
        goal=state_of(state),
    )
    second = replace(
        segment,
        t0=instant,
        phases=tuple(phases[1]),
        feet=tuple(replace(f, down=max(0.0, f.down - at), up=f.up - at) for f in late if f.up > at),
        swings=tuple(swings[1]),
        turning=(before, after, begin_turn - at, end_turn - at),
        start=state_of(state),
    )
    return first, second


def _cut(swing: Swing, at: float) -> tuple[list[Swing], list[Swing]]:
    if swing.t1 <= at:
        return [swing], []
    later = replace(swing, t0=swing.t0 - at, t1=swing.t1 - at)
    if swing.t0 >= at:
        return [], [later]
    since = np.array([at - swing.t0])
    paths = between(swing.t1 - swing.t0, swing.start, swing.goal)
    speeds = [derivative(path) for path in paths]
    pulls = [derivative(speed) for speed in speeds]
    state = tuple(float(values(path, since)[0]) for path in (*paths, *speeds, *pulls))
    u = swing.u0 + (swing.u1 - swing.u0) * float(since[0]) / (swing.t1 - swing.t0)
    first = replace(swing, t1=at, u1=u, goal=state)
    return [first], [replace(later, t0=0.0, u0=u, start=state)]
