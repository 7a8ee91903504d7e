"""When each tick of a run is over, in the seconds of its motion."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import accumulate

from safenav.motion.file.records import Drive, Flight, Motion, Segment


def clock_of(motion: Motion) -> Callable[[int], float]:
    """Seconds at the end of a tick: when the last robot has carried it out, and never earlier
    than the tick before."""
    ends: dict[int, float] = {}
    for line in motion.lines:
        if isinstance(line, Segment | Flight | Drive):
            ends[line.tick] = max(ends.get(line.tick, 0.0), line.t1)
    ticks = sorted(ends)
    seconds = [*accumulate((ends[tick] for tick in ticks), max)]

    def clock(tick: int) -> float:
        known = bisect_right(ticks, tick)
        return seconds[known - 1] if known else 0.0

    return clock
