"""The part of a walker's segment before an instant within it."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from safenav.motion.file.records import PressurePhase, Segment, Swing
from safenav.motion.polynomial import between, derivative, values
from safenav.motion.walker.pendulum import advanced, state_of


def before(segment: Segment, at: float, omega: float) -> Segment:
    """Return a segment until an instant within it (seconds since its start)."""
    state = np.array(segment.start)
    phases: list[PressurePhase] = []
    begin = 0.0
    for phase in segment.phases:
        if begin < at:
            lasting = min(begin + phase.seconds, at) - begin
            here, there = np.array([phase.x, phase.y]), np.array([phase.to_x, phase.to_y])
            there = here + (there - here) * lasting / phase.seconds
            x, y = there.tolist()
            phases.append(replace(phase, seconds=lasting, to_x=x, to_y=y))
            state = advanced(state, here, there, lasting, omega)
        begin += phase.seconds
    return replace(
        segment,
        t1=segment.t0 + at,
        phases=tuple(phases),
        feet=tuple(replace(f, up=min(f.up, at)) for f in segment.feet if f.down < at),
        swings=tuple(_cut(swing, at) for swing in segment.swings if swing.t0 < at),
        goal=state_of(state),
    )


def _cut(swing: Swing, at: float) -> Swing:
    if swing.t1 <= at:
        return swing
    since = np.array([at - swing.t0])
    paths = between(swing.t1 - swing.t0, swing.start, swing.goal)
    speeds = [derivative(path) for path in paths]
    pulls = [derivative(speed) for speed in speeds]
    state = tuple(float(values(path, since)[0]) for path in (*paths, *speeds, *pulls))
    u = swing.u0 + (swing.u1 - swing.u0) * float(since[0]) / (swing.t1 - swing.t0)
    return replace(swing, t1=at, u1=u, goal=state)
