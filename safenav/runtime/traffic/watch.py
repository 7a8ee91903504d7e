"""The watch: who has not come nearer to what it is told to reach for too long.

A strategy relies on the others' being infinitely often out of its way. Nobody can see that fail;
what can be seen is a robot that gets no nearer to its goal poses. Only progress on what it is told
*now* counts: a robot that holds meets its goal in every tick, which means nothing once it is sent
somewhere.
"""

from __future__ import annotations

from collections.abc import Hashable

from safenav.dataclass import dataclass
from safenav.world.poses import FAR


@dataclass
class _Wait:
    told: Hashable
    nearest: int
    since: int


class Watch:
    """Counts ticks without progress. ``slowest``: ticks of the slowest step of the team."""

    def __init__(self, slowest: int) -> None:
        self.patience = 3 * slowest + 2
        self._waits: dict[str, _Wait] = {}

    def look(self, robot: str, told: Hashable, distance: int, tick: int) -> bool:
        """Whether a robot that is told ``told`` and has still ``distance`` steps to go (FAR: no
        way, or nowhere to go) starves. Call once a tick."""
        wait = self._waits.get(robot)
        if distance >= FAR or distance == 0:
            self._waits.pop(robot, None)
            return False
        if wait is None or wait.told != told or distance < wait.nearest:
            self._waits[robot] = _Wait(told, distance, tick)
            return False
        return tick - wait.since >= self.patience

    def begin_anew(self) -> None:
        """Everybody gets its full patience again: a plan was tried."""
        self._waits.clear()
