"""Starvation watch: robots that have made no progress towards their target for too long.

A strategy assumes that the others are infinitely often out of its way. No finite run shows that
this fails; it does show a robot that gets no nearer to its goal poses. Only progress on its
*current* assignment counts: a robot that holds meets its goal in every tick, which means nothing
after it is sent somewhere.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping

from msgspec import Struct

from safenav.world.poses import FAR


class _Wait(Struct):
    told: Hashable
    nearest: int
    since: float


class Watch:
    """Counts ticks without progress. ``slowest``: ticks of the team's slowest step; ``waited``:
    those for which robots had waited before the run."""

    def __init__(self, slowest: int, waited: Mapping[str, int] | None = None) -> None:
        self.patience = 3 * slowest + 2
        self._waits: dict[str, _Wait] = {}
        self._waited = dict(waited or {})

    def look(self, robot: str, told: Hashable, distance: int, tick: float) -> bool:
        """Whether a robot with the assignment ``told`` and ``distance`` remaining steps (FAR:
        no path, or nowhere to go; its wait continues) starves. Call once per tick (in a live
        run, of the duration of a step)."""
        wait, before = self._waits.get(robot), self._waited.pop(robot, 0)
        if distance == 0:
            self._waits.pop(robot, None)
        if distance >= FAR or distance == 0:
            return False
        if wait is None or wait.told != told or distance < wait.nearest:
            self._waits[robot] = _Wait(told, distance, tick - before)
            return before >= self.patience
        return tick - wait.since >= self.patience

    def ages(self, tick: float) -> Hashable:
        """Return for each robot its target and the time that it has waited for it."""
        return tuple((n, w.told, w.nearest, tick - w.since) for n, w in self._waits.items())

    def begin_anew(self) -> None:
        """Reset the patience of every robot: a plan was tried."""
        self._waits.clear()
        self._waited.clear()
