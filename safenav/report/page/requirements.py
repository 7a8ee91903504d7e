"""The robustness of a scenario's requirements, on the timeline of the replay page."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from safenav.errors import SafenavError
from safenav.trace.trace import Trace

if TYPE_CHECKING:
    from safenav.motion.file.records import Line


def curves_of(trace: Trace) -> list[dict[str, object]]:
    """Return a curve for each requirement of a trace's scenario, on the page's time: seconds of a
    live run, else ticks. The motion is made for it; none without the extra ``motion``, or if the
    trace does not say how its robots move."""
    if not trace.header.scenario.requirements:
        return []
    try:
        from safenav.motion.making import motion_of
        from safenav.motion.requirements import curves

        motion = motion_of(trace)
        found = curves(motion, trace)
    except (ModuleNotFoundError, SafenavError):
        return []
    return found if trace.header.clock is not None else on_ticks(found, trace, motion.lines)


def on_ticks(
    found: Iterable[dict[str, object]], trace: Trace, lines: Iterable[Line]
) -> list[dict[str, object]]:
    """Return curves over seconds as curves over ticks: a tick ends when all its steps have."""
    import numpy as np

    from safenav.motion.file.records import Moving

    last = max((record.tick for record in trace.records), default=0)
    ends = np.zeros(last + 1)
    for line in lines:
        if isinstance(line, Moving):
            ends[min(line.tick, last)] = max(ends[min(line.tick, last)], line.t1)
    ends = np.maximum.accumulate(ends)
    told = []
    for one in found:
        points = one["points"]
        assert isinstance(points, list)
        at = np.interp([second for second, _ in points], ends, np.arange(last + 1))
        placed = [[round(float(x), 3), value] for x, (_, value) in zip(at, points, strict=True)]
        told.append(one | {"points": placed})
    return told
